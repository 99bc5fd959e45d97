"""Where steps are carried out by someone: a terminal, a synthetic participant."""
