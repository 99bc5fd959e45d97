"""How well a threshold would be known, by procedure and number of trials, before anyone comes to the lab."""
