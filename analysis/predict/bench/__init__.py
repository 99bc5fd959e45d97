"""Measured trades: `recoil bench`."""
