"""What is asked of a participant: what an answer may be, which one is right, and the columns that keep it."""
