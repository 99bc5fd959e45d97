"""The table of states as a page to read: `python -m tests.states_page`."""

from __future__ import annotations

import sys
from collections import Counter

from experiments.session import events
from experiments.session.events import Event
from experiments.session.states import TABLE, WHY_NOT, Back, Beneath, Change, No, Over, State, Stay, To

_HEAD = """# States of a live run

Made by `python -m tests.states_page > docs/states.md`; do not edit by hand.

What each event does in each state, as `experiments/session/states.py` says it. `→` leaves the state for another; *over*
lays one over it, *back* takes it away again; what is *kept* changes no state; *beneath* does as the state beneath says;
*else* is refused with the sentence in the last column. What is usual stands in the first row, and in the others only
what is not. Answers, shots and whatever else carries the run on count, by the experimenter's hand, only from a press
that began after the state was painted, by the guard time at least.

| state | what happens | else |
| --- | --- | --- |
"""
_ELSE = "*else*"


def page() -> str:
    """The table as Markdown: what is usual, then a row a state."""
    usual = {kind: _usual(kind) for kind in events.KINDS}
    rows = [("(usual)", usual, ""), *((str(state), _unusual(state, usual), WHY_NOT[state]) for state in State)]
    return _HEAD + "".join(f"| {name} | {_grouped(does)} | {why} |\n" for name, does, why in rows)


def _usual(kind: type[Event]) -> str:
    """What an event does in most states."""
    return Counter(_text(TABLE[kind][state], WHY_NOT[state]) for state in State).most_common(1)[0][0]


def _unusual(state: State, usual: dict[type[Event], str]) -> dict[type[Event], str]:
    does = {kind: _text(TABLE[kind][state], WHY_NOT[state]) for kind in usual}
    return {kind: text for kind, text in does.items() if text != usual[kind]}


def _grouped(does: dict[type[Event], str]) -> str:
    """Events with what they do; those that do the same together."""
    words: dict[str, list[str]] = {}
    for kind, text in does.items():
        words.setdefault(text, []).append(events.word(kind))
    return "; ".join(f"{', '.join(kinds)}: {text}" for text, kinds in words.items())


def _text(change: Change, otherwise: str) -> str:
    """What a change does, in few words."""
    match change:
        case To(state):
            return f"→ {state}"
        case Over(state, None):
            return f"{state} *over* it"
        case Over(state, under):
            return f"→ {under}, {state} *over* it"
        case Back():
            return "*back*"
        case Beneath():
            return "*beneath*"
        case Stay():
            return "*kept*"
        case No(because):
            return _ELSE if because == otherwise else f"“{because}”"


if __name__ == "__main__":
    sys.stdout.write(page())
