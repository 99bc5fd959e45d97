"""An accelerometer on the gun: what it measured of each shot, in a process beside the run.

`docs/howto/measure-what-is-delivered.md` tells how to use one, and how to bring one as a plug-in.
"""
