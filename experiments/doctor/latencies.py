"""How fast a console was, read from the stamps in journals. Pure: records in, times out.

Step to screen: from a step's record to `shown_s` of its outcome, when the console had painted it.
Key to disk: from the key, which is the shot's `pulse_start_s` plus the answer's `response_time_s` (or its `key_time_s`,
where that is another), to the `synced_s` of the answer's record, which stands in the record after it.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

Record = Mapping[str, Any]


@dataclass(frozen=True, slots=True, kw_only=True)
class Latencies:
    """What consoles took, and in how many trials that were answered at one."""

    step_to_screen_ms: tuple[float, ...] = ()
    key_to_disk_ms: tuple[float, ...] = ()
    trials: int = 0


def together(some: Iterable[Latencies]) -> Latencies:
    """The latencies of several journals as one."""
    every = list(some)
    return Latencies(
        step_to_screen_ms=tuple(value for one in every for value in one.step_to_screen_ms),
        key_to_disk_ms=tuple(value for one in every for value in one.key_to_disk_ms),
        trials=sum(one.trials for one in every),
    )


def latencies(records: Sequence[Record]) -> Latencies:
    """What the console took in one journal; nothing in a journal of a run without one, or on a virtual clock."""
    if not records or records[0].get("clock") == "virtual":
        return Latencies()
    return Latencies(
        step_to_screen_ms=tuple(_step_to_screen_ms(records)),
        key_to_disk_ms=tuple(_key_to_disk_ms(records)),
        trials=sum(_shown(record) and _kind(record) == "answered" for record in records),
    )


def _step_to_screen_ms(records: Sequence[Record]) -> Iterator[float]:
    step: Record | None = None
    for record in records:
        if record["kind"] in ("step", "resumed"):
            step = record if record["kind"] == "step" else None  # another process has another clock
        elif record["kind"] == "outcome" and step is not None:
            if _shown(record) and _painted_once(step, record):
                yield 1000 * (record["shown_s"] - step["monotonic_s"])
            step = None


def _painted_once(step: Record, outcome: Record) -> bool:
    """Whether the stamp is the step's own first paint.

    A step that asks nothing of anybody keeps the stamp of the one before it, and a presentation is painted again with
    every shot.
    """
    return bool(outcome["shown_s"] >= step["monotonic_s"]) and _kind(step) != "present"


def _key_to_disk_ms(records: Sequence[Record]) -> Iterator[float]:
    pulse_start_s: float | None = None
    for record, following in pairwise(records):
        if record["kind"] == "resumed":
            pulse_start_s = None
        elif _kind(record) == "fired":
            pulse_start_s = record["body"]["pulse_start_s"]
        elif _shown(record) and _kind(record) == "answered" and None not in (pulse_start_s, following["synced_s"]):
            body = record["body"]
            key_s = pulse_start_s + body.get("key_time_s", body["response_time_s"])
            yield 1000 * (following["synced_s"] - key_s)


def _shown(record: Record) -> bool:
    """Whether a console showed the step of this outcome."""
    return record["kind"] == "outcome" and record.get("shown_s") is not None


def _kind(record: Record) -> str:
    return str(record.get("body", {}).get("kind", ""))
