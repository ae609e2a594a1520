"""Simulating one model, many members of one, and scenarios with many values."""
