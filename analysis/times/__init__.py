"""Choices and their times: the diffusion model's densities and fits, and measures of the speed-accuracy trade-off."""
