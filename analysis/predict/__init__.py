"""Before the data: check, simulate, power, design search, fits of the models, reproduction, measured trades."""
