"""What is measured, one file a case, and their table."""
