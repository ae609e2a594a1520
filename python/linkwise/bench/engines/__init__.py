"""The engines, one file each; what a file offers is in `linkwise.bench.engines.table`."""
