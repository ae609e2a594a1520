"""Ready-made machines: chains and trees of any size, and the arms of the literature."""

from linkwise.scenes.arms import srms, srms_3l5d, ssrms
from linkwise.scenes.chain import chain
from linkwise.scenes.tree import tree

__all__ = ["chain", "srms", "srms_3l5d", "ssrms", "tree"]
