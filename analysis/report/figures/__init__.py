"""What the figures of all features share, and the figures of a shot. matplotlib enters with a figure alone."""

import matplotlib.artist

matplotlib.artist.kwdoc = lambda artist: ""  # noqa: ARG005 - the name is a part of its type
"""Its lists of what can be set, for docstrings that a program does not read, were a fifth of matplotlib's import."""
