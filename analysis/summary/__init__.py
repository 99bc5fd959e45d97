"""Logs into the results of a study, and these into a report."""
