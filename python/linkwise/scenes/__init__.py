"""Ready-made machines: chains and trees of any size, the arms of the literature, its benchmarks
with closed loops, and elastic cables and nets."""

from linkwise.scenes.arms import srms, srms_3l5d, ssrms
from linkwise.scenes.benchmark import benchmark
from linkwise.scenes.cables import net, tether
from linkwise.scenes.chain import chain
from linkwise.scenes.tree import tree

__all__ = ["benchmark", "chain", "net", "srms", "srms_3l5d", "ssrms", "tether", "tree"]
