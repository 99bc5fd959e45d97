"""Import one gun plug-in by its name, and end: `python -m device.plugin NAME`, the process that may hang or crash."""

from __future__ import annotations

import inspect
import os
import sys

from device.messages import said_by
from device.plugin.door import IMPORTED, entry_of


def main(name: str) -> int:
    """0 if it can be imported and called, and says so; else what is wrong with it is the last line on stderr."""
    out = os.dup(1)
    os.dup2(2, 1)  # what a plug-in prints is none of our words
    try:
        make = entry_of(name).load()
        if not callable(make):
            raise TypeError(f"the entry point is {make!r}; it must be a function of (address, methods, clock)")
        inspect.signature(make).bind("", {}, None)
    except Exception as error:  # noqa: BLE001 - a plug-in may do anything
        sys.stderr.write(f"\n{said_by(error)}\n")
        return 1
    os.write(out, IMPORTED)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
