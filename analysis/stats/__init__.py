"""What stands around the core tests, mostly from libraries: corrections, sizes, other tests, what was assumed."""
