"""Speed and iterations of linkwise, in a clone: `python -m benchmarks STUDY`; see README.md here.

Every engine runs in a worker process of its own, with bounded memory and time, so that one that
fails says why and takes nothing else with it. Workers take turns within one run: what disturbs the
machine disturbs all of them.
"""
