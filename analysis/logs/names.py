"""How methods are called in print and in which order they stand: as a column map says, or the journals beside logs."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from itertools import islice
from pathlib import Path

from analysis.logs.files import experiment_in_name, results_above
from analysis.logs.journals import journal_of
from experiments.design.language import METHOD_FACTOR, shown_level
from experiments.record import journal
from experiments.record.head_design import began_with
from experiments.record.journal import Head, JournalError
from experiments.study.study import by_code

_LOOKED_AT = 200
"""So many journals are read for the names of methods that the first ones do not know."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MethodNames:
    """The order of methods, as far as it is known, and what each is called in print."""

    order: tuple[str, ...] = ()
    labels: Mapping[str, str] = field(default_factory=dict)

    def and_then(self, other: MethodNames) -> MethodNames:
        """These names, and behind them what another source knows of further methods."""
        order = tuple(dict.fromkeys((*self.order, *other.order)))
        return MethodNames(order=order, labels={**other.labels, **self.labels})

    def ordered(self, methods: Iterable[str]) -> list[str]:
        """The methods in their order; those that it does not know stand behind, as people count: v2 before v12."""
        known = {method: place for place, method in enumerate(self.order)}
        return sorted(methods, key=lambda method: (known.get(method, len(known)), by_code(method), method))


def names_of_run(head: Head) -> MethodNames:
    """What the design and the gun of a run call its methods, in the order of the design. `JournalError` as `head`."""
    design, gun = began_with(head), gun_labels(head)
    factor = design.factors.get(METHOD_FACTOR)
    order = tuple(map(shown_level, factor.all_levels)) if factor else tuple(gun)
    return MethodNames(order=order, labels=gun | (factor.labels if factor else {}))


def gun_labels(head: Head) -> dict[str, str]:
    """What the gun of a run calls its methods; nothing where the head does not say."""
    found: object = head.setup_json
    for key in ("gun", "methods"):
        found = found.get(key) if isinstance(found, dict) else None
    methods = found.items() if isinstance(found, dict) else ()
    labels = {str(name): method.get("label") for name, method in methods if isinstance(method, dict)}
    return {name: label for name, label in labels.items() if isinstance(label, str)}


def names_beside(paths: Iterable[str], methods: Iterable[str], known: MethodNames) -> MethodNames:
    """`known`, and what journals beside the logs say: one of each results folder and experiment, more if need be."""
    wanted, names, others = set(methods), known, list[str]()
    seen = set[tuple[str, str]]()
    for path in paths:
        where = (results_above(path), experiment_in_name(path))
        if where in seen:
            others.append(path)
        else:
            seen.add(where)
            names = names.and_then(_names_beside(path))
    for path in islice(others, _LOOKED_AT):
        if wanted <= set(names.order):
            break
        names = names.and_then(_names_beside(path))
    return names


def _names_beside(log: str) -> MethodNames:
    """What the journal beside a log says; nothing where there is none that can be read."""
    path = Path(journal_of(log))
    try:
        head = journal.head(path) if path.is_file() else None
        return names_of_run(head) if head is not None else MethodNames()
    except JournalError:  # what is wrong with a journal is for the reading of its log to say
        return MethodNames()
