"""What a user would take instead of our physics, each solving the same shots: imported when `bench physics` runs.

All start at the break-away, which is known in closed form, and go from event to event: edge of the coil, end of the
pulse, turn, edge again (shorted coil), landing. None of these packages is needed by anything else here.
"""
