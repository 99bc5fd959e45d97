"""Words and rules that experiments are made of; the roof of the house stands in `experiments.cli`."""
