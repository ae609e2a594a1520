"""Recording runs: in memory or chunk by chunk in a Zarr store, and opening them again."""
