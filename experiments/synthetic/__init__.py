"""Models of participants: percept, decision, preference."""
