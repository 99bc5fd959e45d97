"""Fits of percept and response times: `recoil fit`."""
