"""The plan of one run: every trial in its order, frozen and hashed before the first."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

from pydantic import TypeAdapter

from device.words import Direction
from experiments.config.setup import sha256

PLAN_FORMAT = 1


@dataclass(frozen=True, slots=True, kw_only=True)
class Trial:
    """One planned trial. `session`, `set` and `trial` count from 1; `trial` runs through the session."""

    session: int
    method: str
    set: int
    trial: int
    direction: Direction
    instruction: str = ""
    """The name of what the participant was told for this set; empty if nothing."""


def where_given(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """A `dict_factory` that leaves out an instruction where there is none: a plan without any keeps its old hash.

    >>> where_given([("set", 1), ("instruction", "")]), where_given([("instruction", "speed")])
    ({'set': 1}, {'instruction': 'speed'})
    """
    return {key: value for key, value in pairs if key != "instruction" or value}


@dataclass(frozen=True, slots=True, kw_only=True)
class Plan:
    """All trials of one participant in one experiment, and the seed they came from.

    `order_row` is the row of the balancing square; `None` if the order is random.
    """

    experiment: str
    participant_id: str
    seed: int
    order_row: int | None
    trials: tuple[Trial, ...]
    format: int = PLAN_FORMAT

    @property
    def methods(self) -> tuple[str, ...]:
        """The methods in the order in which they are met."""
        return tuple(dict.fromkeys(trial.method for trial in self.trials))

    def opens_set(self, trial: Trial) -> bool:
        """Whether a trial is the first of its set."""
        return trial == next(t for t in self.trials if (t.session, t.set) == (trial.session, trial.set))

    def record(self) -> dict[str, Any]:
        """The plan as plain JSON values, without instructions where there are none."""
        return asdict(self, dict_factory=where_given)

    @classmethod
    def from_record(cls, record: object) -> Plan:
        """The plan that a journal's head holds; `pydantic.ValidationError` if it holds none."""
        return _PLAN.validate_python(record)

    def sha256(self) -> str:
        """The hash that names this plan: SHA-256 over its canonical JSON."""
        return sha256(self.record())


_PLAN = TypeAdapter(Plan)
