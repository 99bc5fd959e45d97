"""Words and rules that experiments are made of; the feature of the house stands in `experiments.cli`."""
