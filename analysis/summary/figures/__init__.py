"""The figures of the two experiments, drawn from plain values."""
