"""A program of `tests/warm_start.py`, seen from outside: its streams, signals, death and exit code are this one's.

Started as `python -S -E warm_client.py SOCKET WORDS...`; imports next to nothing, as it is started often.
"""

import os
import signal
import socket
import sys

FORWARDED = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT)


def ask(
    line: socket.socket, words: list[str], *, folder: bytes, environment: dict[bytes, bytes], streams: list[int]
) -> None:
    """Ask the server at the other end of a line for a program; it tells the exit code on the same line."""
    pairs = [b"%s=%s" % pair for pair in environment.items()]
    request = b"\0".join([folder, b"%d" % len(words), *map(os.fsencode, words), *pairs])
    socket.send_fds(line, [len(request).to_bytes(8, "big")], streams)
    line.sendall(request)


def main() -> None:
    address, *words = sys.argv[1:]
    with socket.socket(socket.AF_UNIX) as line:
        line.connect(address)
        for number in FORWARDED:
            signal.signal(number, lambda got, _: line.send(bytes([got])))
        here = os.getcwdb()  # noqa: PTH109 — as bytes
        ask(line, words, folder=here, environment=dict(os.environb), streams=[0, 1, 2])
        told = line.recv(16)
    code = int(told or 1)
    if code < 0:
        signal.signal(-code, signal.SIG_DFL)
        os.kill(os.getpid(), -code)
    sys.exit(code)


if __name__ == "__main__":
    main()
