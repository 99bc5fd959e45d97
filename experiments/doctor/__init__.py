"""The rig's self-test: what is measured, how it is judged, and what to do about what is not good."""
