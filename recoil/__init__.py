"""Psychophysics experiments on haptic guns. The command line; what it does is done in the rooms beneath."""
