"""The design search and the critical conditions: `recoil design`."""
