"""What describes flexible links: sections of beams, and bodies of finite elements."""

from linkwise.flexible.readers import FiniteElementMatrices, read_matrices

__all__ = ["FiniteElementMatrices", "read_matrices"]
