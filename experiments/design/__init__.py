"""From a config to a plan: orders, balance, random streams. Pure."""
