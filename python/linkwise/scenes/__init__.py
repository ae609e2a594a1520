"""Ready-made machines: chains and trees of any size, the arms of the literature, and its
benchmarks with closed loops."""

from linkwise.scenes.arms import srms, srms_3l5d, ssrms
from linkwise.scenes.benchmark import benchmark
from linkwise.scenes.chain import chain
from linkwise.scenes.tree import tree

__all__ = ["benchmark", "chain", "srms", "srms_3l5d", "ssrms", "tree"]
