"""The participant's screen as a program.

Its output carries words and nothing else: what libraries print is turned to the errors before any of them is imported.
"""

from __future__ import annotations

import os
import signal
import sys

from experiments.screens.participant.messages import look_from
from experiments.screens.participant.stage import writable_home


def main() -> int:
    """Run until the console says close, and give back the exit code."""
    signal.signal(signal.SIGINT, signal.default_int_handler)  # a console in the background has it ignored
    look = look_from(sys.argv[1:])
    said = os.fdopen(os.dup(1), "wb")  # ours alone: a program that a library starts does not get it
    os.dup2(2, 1)
    sys.stdout = sys.stderr
    with writable_home():
        from experiments.screens.participant.app import run_program  # noqa: PLC0415 - after the output is safe

        return run_program(look, sys.stdin.buffer, said)


if __name__ == "__main__":
    code = main()
    sys.stderr.flush()
    os._exit(code)  # at once: neither a library's last acts nor the thread that still listens are waited for
