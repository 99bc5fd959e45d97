"""A program of `tests/warm_start.py`, seen from outside: its streams, signals, death and exit code are this one's.

Started as `python -S -E warm_client.py SOCKET WORDS...`; imports next to nothing, as it is started often.
"""

import os
import signal
import socket
import sys

FORWARDED = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT)


def main() -> None:
    address, *words = sys.argv[1:]
    with socket.socket(socket.AF_UNIX) as line:
        line.connect(address)
        for number in FORWARDED:
            signal.signal(number, lambda got, _: line.send(bytes([got])))
        environment = [b"%s=%s" % pair for pair in os.environb.items()]
        request = b"\0".join(
            [
                os.getcwdb(),  # noqa: PTH109 — as bytes
                b"%d" % len(words),
                *map(os.fsencode, words),
                *environment,
            ]
        )
        socket.send_fds(line, [len(request).to_bytes(8, "big")], [0, 1, 2])
        line.sendall(request)
        told = line.recv(16)
    code = int(told or 1)
    if code < 0:
        signal.signal(-code, signal.SIG_DFL)
        os.kill(os.getpid(), -code)
    sys.exit(code)


if __name__ == "__main__":
    main()
