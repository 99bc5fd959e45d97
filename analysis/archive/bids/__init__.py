"""Logs as a BIDS data set."""
