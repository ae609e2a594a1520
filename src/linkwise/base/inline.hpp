#pragma once
// Kernels are chains of tiny functions on small structs: they pay off only when every one of them
// is inlined and every constant loop is unrolled, so neither is left to the optimiser's heuristics.
#define LW_INLINE __attribute__((always_inline)) inline
