"""The engines, one file each; what a file offers is in `benchmarks.engines.table`."""
