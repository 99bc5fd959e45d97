"""Experiment 2: how do you like it? Each method felt until `next`, then rated and described."""
