"""Guns that other packages bring: how one is found and let in, the guard that stands before it, and what it must keep.

`docs/howto/gun-plugin.md` tells how to write one; `device.plugin.conformance` is what its own tests call.
"""
