"""A host that arms a gun and keeps it armed, until it is killed: `python armed_host.py ADDRESS`."""

import sys
import time

from device import open_gun

if __name__ == "__main__":
    gun = open_gun(sys.argv[1])
    gun.arm()
    print("armed", flush=True)  # noqa: T201 - whoever kills it waits for this
    time.sleep(3600)
