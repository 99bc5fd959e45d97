"""The plan of one run, every trial in its order, frozen and hashed before the first; and the order of methods."""

from __future__ import annotations

from dataclasses import dataclass, fields, is_dataclass, replace
from functools import cache
from typing import Any

from pydantic import TypeAdapter

from device.words import Direction
from experiments.config.door import Order
from experiments.config.setup import sha256
from experiments.design.language import DIRECTION_FACTOR, EMPTY, INSTRUCTION_FACTOR, METHOD_FACTOR, Level


def square_rows(order: Order, count: int) -> list[list[int]]:
    """All rows of a balancing square over `count` methods; none for a random order.

    A Latin square has each method once at each place. Williams' design has, beyond that, each method equally often
    right after each other one: `count` rows if it is even, twice as many if it is odd (Williams 1949).

    >>> square_rows("latin-square", 3)
    [[0, 1, 2], [1, 2, 0], [2, 0, 1]]
    >>> square_rows("williams", 4)
    [[0, 3, 1, 2], [1, 0, 2, 3], [2, 1, 3, 0], [3, 2, 0, 1]]
    """
    if order == "random":
        return []
    first = list(range(count)) if order == "latin-square" else _zigzag(count)
    square = [[(place + shift) % count for place in first] for shift in range(count)]
    if order == "williams" and count % 2:
        square += [row[::-1] for row in square]
    return square


def _zigzag(count: int) -> list[int]:
    """0, count - 1, 1, count - 2, ...: neighbours differ by every amount once."""
    return [place // 2 if place % 2 == 0 else count - 1 - place // 2 for place in range(count)]


PLAN_FORMAT = 2
Condition = tuple[tuple[str, Level], ...]
"""Names of factors with their levels."""


def condition(**levels: Level) -> Condition:
    """The levels of factors by name, but for those that are empty.

    >>> condition(method="vibration", instruction="")
    (('method', 'vibration'),)
    """
    return tuple((name, level) for name, level in levels.items() if level != "")


CHOSEN = "chosen"
"""In an interval: the level that a procedure chooses when its trial comes. No level that it may choose is called so."""


def in_interval(factor: str, place: int) -> str:
    """The name of a factor's level in an interval, counted from 1: that of its column.

    >>> in_interval("voltage_V", 2)
    'voltage_V_2'
    """
    return f"{factor}_{place}"


_BLANKS: dict[str, object] = {
    "practice": False,
    "instruction": "",
    "compare": "",
    "intervals": (),
    "odd": None,
    "catch": False,
    "track": 0,
    "chosen": (),
    "at_edge": False,
    "shown": False,
    "settings": (),
    "interval": 0,
    "gap_s": 0.0,
    "later": False,
    "may_end_early": False,
    "distinct": False,
}
"""What most trials and steps do not have, by the name of its field."""


def plain_fields(value: Any) -> dict[str, object]:
    """The fields of a plan, step or remark as plain JSON values, and those of what it holds.

    Of an instruction, intervals or a catch that is not there no key is kept. `dataclasses.asdict` copies every value
    deeply, which was an eighth of what a run computes.

    >>> plain_fields(Trial(session=1, set=2, trial=3, levels=(("method", "vibration"),)))
    {'session': 1, 'set': 2, 'trial': 3, 'levels': (('method', 'vibration'),)}
    """
    named = ((field.name, getattr(value, field.name)) for field in fields(value))
    return {name: _plain(one) for name, one in named if name not in _BLANKS or one != _BLANKS[name]}


def _plain(value: object) -> object:
    if isinstance(value, tuple):
        return tuple(map(_plain, value))
    return plain_fields(value) if is_dataclass(value) else value


@dataclass(frozen=True, slots=True, kw_only=True)
class Trial:
    """One planned trial. `session`, `set` and `trial` count from 1; `trial` runs through the session.

    `intervals` are the levels of the factor `compare`, in the order in which they are felt, and `odd` the place among
    them (from 0) of the comparison: in ABX of the one that X repeats. A `catch` trial has no stimulus. A trial of a
    `track`, counted from 1, has no level of the factors that its procedure adapts, and `CHOSEN` in its intervals.
    """

    session: int
    set: int
    trial: int
    levels: Condition
    compare: str = ""
    intervals: tuple[Level, ...] = ()
    odd: int | None = None
    catch: bool = False
    track: int = 0

    @property
    def place(self) -> tuple[int, int, int]:
        """Which one of its plan it is."""
        return self.session, self.set, self.trial

    def with_chosen(self, chosen: Condition) -> Trial:
        """The trial with the levels that a procedure chose for it, where it has none yet: what was felt.

        Those of a pair are named as the factor that is compared `in_interval`.
        """
        named, known = {in_interval(self.compare, at): at for at, _ in enumerate(self.intervals, start=1)}, dict(chosen)
        held = tuple(
            known.get(name, known.get(self.compare, level)) if level == CHOSEN else level
            for name, level in zip(named, self.intervals, strict=True)
        )
        new = tuple(pair for pair in chosen if pair[0] not in named and self.level(pair[0]) is None)
        return replace(self, levels=(*self.levels, *new), intervals=held)

    def level(self, name: str) -> Level | None:
        """The level of a factor; `None` if the trial has none."""
        return next((level for factor, level in self.levels if factor == name), None)

    @property
    def method(self) -> str:
        """The rendering method; empty where the methods are what is compared."""
        return str(self.level(METHOD_FACTOR) or "")

    def levels_at(self, interval: int) -> Condition | None:
        """The levels of an interval, counted from 0; `None` if nothing is felt in it."""
        if self.catch:
            return None
        if not self.intervals:
            return self.levels
        level = self.intervals[interval]
        if level == EMPTY:
            return None
        return (*(pair for pair in self.levels if pair[0] != self.compare), (self.compare, level))

    def direction_at(self, interval: int) -> Direction:
        """Which way the gun points in an interval: forward, where the design does not say."""
        return "backward" if (DIRECTION_FACTOR, "backward") in (self.levels_at(interval) or self.levels) else "forward"

    @property
    def direction(self) -> Direction:
        """Which way the gun points first."""
        return self.direction_at(0)

    @property
    def instruction(self) -> str:
        """The name of what the participant was told for this set; empty if nothing."""
        return str(self.level(INSTRUCTION_FACTOR) or "")


@dataclass(frozen=True, slots=True, kw_only=True)
class Plan:
    """All trials of one participant in one experiment, and the seed they came from.

    `order_row` is the row of the balancing square; `None` if the order is random. `group`: which combination of the
    levels that vary between people is this participant's, counted from 0. `may_end_early`: tracks may be over before
    all of their trials are done.
    """

    experiment: str
    participant_id: str
    seed: int
    order_row: int | None
    trials: tuple[Trial, ...]
    group: int = 0
    practice: bool = False
    may_end_early: bool = False
    format: int = PLAN_FORMAT

    @property
    def methods(self) -> tuple[str, ...]:
        """The methods in the order in which they are met, but for those that are compared within a trial."""
        return tuple(dict.fromkeys(trial.method for trial in self.trials if trial.method))

    def set_of(self, trial: Trial) -> list[Trial]:
        """The trials of the set that a trial is of."""
        return [one for one in self.trials if (one.session, one.set) == (trial.session, trial.set)]

    def opens_set(self, trial: Trial) -> bool:
        """Whether a trial is the first of its set."""
        return trial == self.set_of(trial)[0]

    def record(self) -> dict[str, object]:
        """The plan as plain JSON values."""
        return plain_fields(self)

    @classmethod
    def from_record(cls, record: object) -> Plan:
        """The plan that a journal's head holds; `pydantic.ValidationError` if it holds none."""
        return _plan_reader().validate_python(record)

    def sha256(self) -> str:
        """The hash that names this plan: SHA-256 over its canonical JSON."""
        return sha256(self.record())


@cache
def _plan_reader() -> TypeAdapter[Plan]:
    return TypeAdapter(Plan)
