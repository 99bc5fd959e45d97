"""Data sets for others to keep and to read."""
