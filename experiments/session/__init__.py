"""What should happen and what did: steps, events, states, remarks. Pure."""
