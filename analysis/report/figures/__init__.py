"""What the figures of all features share, and the figures of a shot. matplotlib enters with a figure alone."""
