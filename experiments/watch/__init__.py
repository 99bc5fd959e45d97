"""The read-only page about runs in progress."""
