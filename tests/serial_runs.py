"""Whole runs on the twin with troubles, and what must be true of their journals and of what the twin rendered."""

from __future__ import annotations

import csv
import re
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from device import LinkError
from device.serial_gun.gun import speed_of
from device.serial_gun.reports import WAYS
from device.twin.twin import Rendered, Twin
from experiments import run as runs
from experiments.clock import RealClock
from experiments.live_run import RunStopped
from experiments.load import load_setup
from experiments.record.journal import Contents, read_journal
from experiments.record.names import Place
from experiments.record.replay import history
from experiments.run_request import RunRequest
from experiments.screens.synthetic import synthetic_screen
from experiments.session.steps import Answered, Failed, Fired
from experiments.study.folders import place
from tests.journals import raw
from tests.twins import Troubles

UNSURE = re.compile("fired and cut short|may have been fired|was fired, and its answer was lost|the gun rendered")
"""What a cause says of a shot that may have been felt."""


@dataclass(kw_only=True)
class Tally:
    """What came of some runs."""

    trials: int = 0
    done: list[tuple[Any, Fired]] = field(default_factory=list)
    causes: Counter[str] = field(default_factory=Counter)
    stops: int = 0


def hasty(folder: Path, hand_over_s: float = 0.3) -> Path:
    """A config without waiting: no hand-over but for the magnet's way home."""
    config = folder / "direction.toml"
    config.write_text(re.sub(r"hand_over_s = [\d.]+", f"hand_over_s = {hand_over_s}", config.read_text()))
    return config


def long_trains(folder: Path, exposure_s: float, **more: float) -> Path:
    """Experiment 2 with trains felt for so long in the mean, a second for whatever else, and more keys."""
    config, people = folder / "preference.toml", folder / "synthetic" / "preference.toml"
    quick = {"opening_s": 1.0, "hand_over_s": 1.0, "answer_s": 1.0}
    for path, values in ((config, quick | more), (people, {"exposure_s": exposure_s})):
        for key, value in values.items():
            text, found = re.subn(rf"^{key} = [\d.]+", f"{key} = {value}", path.read_text(), flags=re.MULTILINE)
            assert found == 1, key
            path.write_text(text)
    return config


def one_run(config: Path, results: Path, gun: str, code: str, again: Any) -> Place:
    """A person's run, on a clock as fast as the twin lives."""
    setup = load_setup(str(config))
    seed = int(code.removeprefix("P"))
    request = RunRequest(setup=setup, participant_id=code, results=results, gun=gun, seed=seed, again=again)
    return runs.run(request, synthetic_screen, RealClock(speed_of(gun) or 1.0)).place


def resumed(run: Callable[[Any], Place], tally: Tally | None = None) -> Place:
    """A run that is gone on with whenever it stops for want of a gun."""
    again = "ask"
    for _ in range(50):
        try:
            return run(again)
        except (RunStopped, LinkError) as stop:
            again = "resume" if isinstance(stop, RunStopped) else again
            if tally is not None:
                tally.stops += 1
    raise AssertionError


def run_all(config: Path, results: Path, gun: str, people: range) -> Tally:
    """One run a person, gone on with whenever it stops for want of a gun."""
    tally = Tally()
    for person in people:
        code = f"P{person:04}"
        resumed(lambda again, code=code: one_run(config, results, gun, code, again), tally)
        _count(tally, results, code)
    return tally


def _count(tally: Tally, results: Path, code: str) -> None:
    contents = read_journal(place(results, code, "direction").journal)
    assert contents.finished
    answered = set()
    for step, outcome in history(contents):
        if isinstance(outcome, Fired):
            tally.done.append((step.trial, outcome))
        elif isinstance(outcome, Failed):
            tally.causes[outcome.cause] += 1
        elif isinstance(outcome, Answered):
            answered.add(step.trial)
    planned = contents.plan.trials
    assert len(answered) == len(planned)
    tally.trials += len(answered)


def check(tally: Tally, twin: Twin, slack_s: float) -> dict[str, int]:
    """Every shot in the journals was rendered once, as and when they say; every other is marked. The figures."""
    ledger = list(twin.body.ledger)
    assert [true for true in ledger if true.too_soon] == []
    wrong = []
    for trial, fired in tally.done:
        true = _nearest(ledger, fired.pulse_start_s)
        ledger.remove(true)  # no two shots of a journal are the same one
        if not _agree(trial, fired, true, slack_s):
            wrong.append((trial, fired, true))
    unsure = sum(count for cause, count in tally.causes.items() if UNSURE.search(cause))
    assert wrong == []
    assert len(ledger) <= unsure, dict(tally.causes)
    return {
        "trials": tally.trials,
        "done": len(tally.done),
        "marked": tally.causes.total(),
        "unsure": unsure,
        "rendered and marked": len(ledger),
        "stops": tally.stops,
        "accidents": len(twin.accidents),
    }


def _agree(trial: Any, fired: Fired, true: Rendered, slack_s: float) -> bool:
    """Whether a shot was as the journal says: method, direction, onset within its bound, length, order of times."""
    timing = fired.timing
    if timing is None or true.end_s is None:
        return False
    driven_s = fired.pulse_end_s - fired.pulse_start_s
    return (
        (true.method, true.way) == (trial.method, WAYS[trial.direction])
        and abs(true.start_s - fired.pulse_start_s) <= timing.uncertainty_s + slack_s
        and abs(driven_s - (true.end_s - true.start_s)) <= slack_s
        and timing.requested_s <= timing.written_s <= timing.acknowledged_s
    )


def _nearest(ledger: list[Rendered], time_s: float) -> Rendered:
    return min(ledger, key=lambda true: abs(true.start_s - time_s))


def of_trains(contents: Contents) -> Iterator[tuple[list[dict[str, Any]], dict[str, Any] | None]]:
    """The shots of each presentation, and its outcome if it has one."""
    shots: list[dict[str, Any]] | None = None
    for entry in raw(contents.path):
        if entry["kind"] == "step":
            if shots is not None:
                yield shots, None
            shots = [] if entry["body"]["kind"] == "present" else None
        elif entry["kind"] == "shot" and shots is not None:
            shots.append(entry["body"])
        elif entry["kind"] == "outcome" and shots is not None:
            yield shots, entry["body"]
            shots = None
    if shots is not None:
        yield shots, None


def timings_of(contents: Contents) -> list[dict[str, Any]]:
    """How every shot in a journal came about that was done, in order."""
    bodies = [entry["body"] for entry in raw(contents.path) if entry["kind"] in ("outcome", "shot")]
    return sorted((body["timing"] for body in bodies if "timing" in body), key=lambda one: one["requested_s"])


SPEED = 40.0
TROUBLES = Troubles(
    jitter_s=0.002,
    lose=0.004,
    double=0.004,
    corrupt=0.004,
    partial=0.004,
    reset=0.01,
    busy=0.01,
    hang=0.01,
    unplug=0.01,
    unplug_reply=0.002,
    unplug_idle=0.002,
    hang_s=0.3,
    replug_s=0.1,
)
DIFFERENT = ("onset_utc", "response_time_s", "gun", "exposure_s", "attempts")
"""Columns that differ from run to run: times, and how often a busy machine, away for long, had to present a trial."""


def rows(path: Path) -> list[dict[str, str]]:
    with path.open(encoding="utf-8", newline="") as file:
        return [{key: cell for key, cell in row.items() if key not in DIFFERENT} for row in csv.DictReader(file)]
