"""What a run leaves: the journal, what is derived from it, and where it came from."""
