"""Simulated studies: `recoil power`."""
