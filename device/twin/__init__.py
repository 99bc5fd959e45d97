"""The gun's twin: what the firmware does, without a gun. The core is pure; only `ports` and `twin` touch the system."""

MODEL, SERIAL = "haptic-gun", "TWIN-1"
"""What the twin calls itself on the line."""
