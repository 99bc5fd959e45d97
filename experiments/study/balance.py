"""Which order of a balancing square, and which group, the next run gets: those that were used least so far."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from experiments.config.setup import Setup
from experiments.design import planning
from experiments.design.config import DesignConfig
from experiments.design.plan import Plan
from experiments.record import journal
from experiments.record.journal import Head, JournalError, ParticipantKind
from experiments.record.names import journals
from experiments.study.register import Register

HeadOf = Callable[[Path], Head | None]
"""Gives the head of a journal; `None` where nothing in it was acknowledged."""


def row_of_next_run(
    setup: Setup[DesignConfig],
    results: Path,
    registered: Register,
    head_of: HeadOf = journal.head,
    *,
    by: ParticipantKind = "person",
) -> int | None:
    """The row of the balancing square that the next run takes; `None` for a random order.

    The least used row over the runs of participants of the same group who are not excluded, the first such row. So in
    each group rows are used equally often, to within one, whenever everyone who was excluded has been replaced. People
    and synthetic participants are counted apart.
    """
    config = setup.config
    size, group = planning.square_size(config), group_of_next_run(setup, results, registered, head_of, by=by)
    return least_used(size, used_rows(results, config.design, registered, head_of, group, by=by)) if size else None


def group_of_next_run(
    setup: Setup[DesignConfig],
    results: Path,
    registered: Register,
    head_of: HeadOf = journal.head,
    *,
    by: ParticipantKind = "person",
) -> int:
    """Which combination of the levels that vary between people the next run gets: the least used, the first such."""
    config = setup.config
    count = len(planning.groups(config))
    if count == 1:
        return 0
    return least_used(count, [one.group for one in _plans(results, config.experiment, registered, head_of, by)])


def is_balanced(config: DesignConfig) -> bool:
    """Whether what a run gets hangs on the runs before it."""
    return planning.square_size(config) > 0 or len(planning.groups(config)) > 1


def least_used(count: int, used: Sequence[int]) -> int:
    """The number below `count` that was used least, the first of them.

    >>> least_used(3, [0, 1, 1])
    2
    """
    return min(range(count), key=lambda one: (list(used).count(one), one))


def used_rows(
    results: Path,
    experiment: str,
    registered: Register,
    head_of: HeadOf = journal.head,
    group: int = 0,
    *,
    by: ParticipantKind = "person",
) -> list[int]:
    """The rows that runs of a group in this folder have taken; who is excluded gives theirs back."""
    plans = _plans(results, experiment, registered, head_of, by)
    return [plan.order_row for plan in plans if plan.order_row is not None and plan.group == group]


def unread(setup: Setup[DesignConfig], results: Path, registered: Register) -> tuple[str, ...]:
    """Why the order of a next run cannot be balanced against some of the others: a line a journal that is unreadable.

    Nothing where orders are drawn at random.
    """
    if not planning.square_size(setup.config) and len(planning.groups(setup.config)) == 1:
        return ()
    found = (_plan(path, journal.head) for path in _counted(results, setup.config.experiment, registered))
    return tuple(f"{one}; its order does not count in the balance" for one in found if isinstance(one, JournalError))


def _plans(results: Path, experiment: str, registered: Register, head_of: HeadOf, by: ParticipantKind) -> list[Plan]:
    """The plans of the runs of people, or of synthetic participants, who are not excluded.

    As far as their journals can be read (see `unread`).
    """
    found = (_plan(path, head_of, by) for path in _counted(results, experiment, registered))
    return [one for one in found if isinstance(one, Plan)]


def _counted(results: Path, experiment: str, registered: Register) -> list[Path]:
    left_out = registered.excluded()
    return [path for path in journals(results, experiment) if _code(path) not in left_out]


def _plan(path: Path, head_of: HeadOf, by: ParticipantKind | None = None) -> Plan | JournalError | None:
    """The plan of a run, or why it cannot be read: nobody's broken journal stops another participant."""
    try:
        head = head_of(path)
        return None if head is None or by not in (None, head.participant) else head.plan
    except JournalError as error:
        return error


def _code(journal_path: Path) -> str:
    return journal_path.parent.name.removeprefix("sub-")
