"""Designs drawn at random from the whole language, sensible and senseless ones, of few trials."""

from __future__ import annotations

from typing import Any

from hypothesis import strategies as st

VOLTS = st.lists(st.sampled_from([8.0, 10.0, 12.0, 14.0, 16.0, 18.0]), min_size=1, max_size=3, unique=True)
METHODS = st.lists(st.sampled_from(["vibration", "asymmetric-1", "asymmetric-2"]), min_size=1, max_size=3, unique=True)
WAYS = st.lists(st.sampled_from(["forward", "backward"]), min_size=1, max_size=2, unique=True)
FREE = st.lists(st.sampled_from(["sitting", "standing", "lying"]), min_size=1, max_size=3, unique=True)
SMALL = st.integers(1, 4)


@st.composite
def factors(draw: st.DrawFn) -> dict[str, Any]:
    methods = draw(METHODS)
    found: dict[str, Any] = {"method": {"levels": methods}}
    if draw(st.booleans()):
        found["direction"] = {"levels": draw(WAYS)}
    if draw(st.booleans()):
        nested = draw(st.booleans())
        levels: Any = {name: draw(VOLTS) for name in methods} if nested else draw(VOLTS)
        found["voltage_V"] = {"levels": levels} | ({"within": "method"} if nested else {})
    if draw(st.booleans()):
        found["posture"] = {"levels": draw(FREE), "between": draw(st.booleans())}
    if draw(st.booleans()):
        texts = {name: f"Be {name}." for name in draw(st.sampled_from([("fast",), ("fast", "sure")]))}
        found["instruction"] = {"levels": [*texts], "texts": texts}
    return found


@st.composite
def orders(draw: st.DrawFn, names: list[str]) -> dict[str, Any]:
    some = st.lists(st.sampled_from(names), max_size=2, unique=True)
    order = st.sampled_from(["random", "fixed", "latin-square", "williams"])
    return {
        "session": draw(some),
        "set": draw(some),
        "sessions": draw(order),
        "trials": draw(order),
        "sets": draw(SMALL),
        "repetitions": draw(SMALL),
        "balance": draw(st.sampled_from(["session", "set", "set-exact"])),
        "longest_run": draw(st.dictionaries(st.sampled_from(names), SMALL, max_size=1)),
    }


@st.composite
def trials(draw: st.DrawFn, names: list[str]) -> dict[str, Any]:
    kind = draw(st.sampled_from(["single", "single", "train", "two-interval", "pair", "abx", "oddity"]))
    found: dict[str, Any] = {"kind": kind, "feedback": draw(st.booleans())}
    if kind not in ("single", "train"):
        found["compare"] = draw(st.sampled_from(names))
    if kind in ("two-interval", "abx", "oddity"):
        found["standard"] = draw(st.sampled_from([15.0, "asymmetric-1", "none"]))
    if kind == "two-interval":
        found["standard_interval"] = draw(st.sampled_from(["random", "first", "second"]))
    if draw(st.integers(0, 3)) == 0:
        found["catch"] = draw(SMALL)
    return found


@st.composite
def questions(draw: st.DrawFn) -> dict[str, Any]:
    kind = draw(st.sampled_from(["choice", "yes-no", "rating", "number", "ranking", "text"]))
    found: dict[str, Any] = {"kind": kind, "text": "?", "when": draw(st.sampled_from(["trial", "block"]))}
    if kind == "choice":
        answers = [["forward", "backward"], ["first", "second"], ["a", "b"], ["first", "second", "third"]]
        found["answers"] = draw(st.sampled_from(answers))
    if kind in ("choice", "yes-no"):
        right = draw(st.sampled_from([None, "direction", "interval", "larger", "stimulus"]))
        found |= {} if right is None else {"correct": right}
    if kind == "rating":
        found |= {"minimum": 1.0, "maximum": 7.0, "grain": draw(st.sampled_from([0.1, 0.5, 1.0, 4.0]))}
    return found


@st.composite
def tables(draw: st.DrawFn) -> dict[str, Any]:
    """The tables of a design, which may be refused."""
    varied = draw(factors())
    return {
        "factors": varied,
        "order": draw(orders([*varied])),
        "trial": draw(trials([*varied])),
        "questions": {name: draw(questions()) for name in draw(st.sampled_from([("q",), ("q", "r")]))},
        "table": draw(st.sampled_from(["trials", "ratings"])),
    }
