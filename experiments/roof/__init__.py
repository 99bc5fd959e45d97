"""The roof: the command line, and what needs the gun, the experiments and the analysis together."""
