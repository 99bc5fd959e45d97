"""Shots by the model: `recoil simulate`."""
