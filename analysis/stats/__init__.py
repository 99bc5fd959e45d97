"""The statistics: arrays in, frozen results out. Our own core, and beside it what libraries add."""
