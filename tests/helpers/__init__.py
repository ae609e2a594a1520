"""Machines, random trees, an independent reference and comparisons shared by the tests."""
