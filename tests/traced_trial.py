"""One live trial on the simulated gun, and which of our files run in it: `python -m tests.traced_trial`.

From the press that fires to the next hand-over, at the console's own side of a run without Qt: its keys, the run in its
thread, gun, journal and judging. A file counts if any function of it runs; those of `tests/` do not count. What runs
only to put the screen into words, whenever that is painted, is listed apart. The trial is the second of its method:
the first one also renders the method.
"""

from __future__ import annotations

import sys
import tempfile
import threading
from collections import Counter
from pathlib import Path
from types import FrameType

from experiments.session.states import State
from tests.at_controls import PaperWindow, Sitting, sat, short_direction

ROOT = Path(__file__).parents[1]
ROOMS = ("device", "experiments", "analysis", "recoil")
MOST = 15


class Trace:
    """Counts the calls in each of our files while it is on, in every thread that was started under it."""

    def __init__(self) -> None:
        self.calls: Counter[str] = Counter()
        self.painted: Counter[str] = Counter()
        self.on = False
        self._painting: set[int] = set()

    def __call__(self, frame: FrameType, event: str, argument: object) -> None:
        del argument
        thread = threading.get_ident()
        if frame.f_code is PaperWindow.paint.__code__ and event in ("call", "return"):
            (self._painting.add if event == "call" else self._painting.discard)(thread)
        if self.on and event == "call" and frame.f_code.co_name != "<module>":
            path = Path(frame.f_code.co_filename)
            if path.is_relative_to(ROOT) and path.relative_to(ROOT).parts[0] in ROOMS:
                book = self.painted if thread in self._painting else self.calls
                book[str(path.relative_to(ROOT))] += 1


def hand_over(sitting: Sitting) -> None:
    """Work on until the gun may be handed over for a trial."""
    while sitting.state is not State.PREPARING:
        sitting.go_on()
    sitting.ready()


def traced(results: Path) -> Trace:
    """The calls in our files, from the press that fires to the next hand-over."""
    trace = Trace()
    threading.setprofile(trace)
    sys.setprofile(trace)
    try:
        with sat(short_direction(sets=1, trials=4, set_break_s=0.0), results) as sitting:
            hand_over(sitting)
            sitting.go_on()
            hand_over(sitting)
            trace.on = True
            sitting.go_on()
            hand_over(sitting)
            trace.on = False
            sitting.stop()
    finally:
        sys.setprofile(None)
        threading.setprofile(None)
    return trace


def main() -> int:
    """Print the files with their calls; 1 if they are too many."""
    with tempfile.TemporaryDirectory() as folder:
        trace = traced(Path(folder))
    calls, screen = trace.calls, {path: count for path, count in trace.painted.items() if path not in trace.calls}
    for title, counted in (("the run", calls), ("the screen's words alone", screen)):
        sys.stdout.write(f"{title}: {len(counted)} files\n")
        sys.stdout.write(
            "".join(f"{counted[path]:5} {path}\n" for path in sorted(counted, key=lambda one: -counted[one]))
        )
    sys.stdout.write(f"{len(calls)} files between the press that fires and the next hand-over (at most {MOST})\n")
    return len(calls) > MOST


if __name__ == "__main__":
    sys.exit(main())
