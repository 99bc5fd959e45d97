"""Experiment 1: which way did it shoot? A balanced two-alternative forced choice."""
