"""A published paper: its numbers, how often they recur, and how they compare with what was obtained."""
