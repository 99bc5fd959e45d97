"""The statistical core, ours: arrays in, frozen results out, to the last digit that a double holds."""
