"""A study: who takes part, in which order, and how far everybody is."""
