"""Speed against accuracy of synthetic participants, by caution: the same people at boundaries near and far."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from analysis.predict.bench.figure import NamedPoint, TradeCurve, TradePanel
from analysis.predict.bench.measured import BenchRequest, Bought, Measured
from analysis.predict.drawn import DirectionStudies, studies_of
from analysis.predict.synthetic_studies import percepts_of_methods
from analysis.report import apa
from analysis.report.section import Section, Table
from analysis.times.first_passage import moments
from device.words import Direction
from experiments.design.streams import Stream
from experiments.load import load_setup, shipped_folder
from experiments.synthetic.diffusion import Person, person
from experiments.synthetic.laws import DiffusionLaw
from experiments.synthetic.model_based import NEUTRAL, ModelParameters, own_diffusion
from experiments.synthetic.percept import Percept

_CAUTIOUS_DESIGN = shipped_folder() / "examples" / "hurry.toml"
_BOUNDARIES = tuple(round(float(one), 3) for one in np.geomspace(0.25, 4.0, 13))
_LONGER_S = 0.1


@dataclass(frozen=True, slots=True, kw_only=True)
class CautionPoint:
    """How often people are right, and how long they take, at a boundary; `instruction` is the one that sets it."""

    method: str
    boundary: float
    instruction: str
    right: float
    time_s: float


@dataclass(frozen=True, slots=True, kw_only=True)
class _Cautious:
    """The people of a design, what they feel by method, and the trials of a run."""

    model: ModelParameters
    people: tuple[Person, ...]
    percepts: dict[str, Percept]
    trials: int


def caution(request: BenchRequest) -> Measured:
    """Mean accuracy and mean time of people over their boundary; nothing is drawn but the people themselves."""
    of = _cautious(request)
    with request.progress("bench caution", len(of.percepts)) as tell:
        rows = []
        for method in of.percepts:
            rows += sorted(_points(of, method), key=lambda one: one.boundary)
            tell(method)
    return Measured(rows=rows, section=_section(rows, of), bought=tuple(_time_bought(rows, of)), panel=_panel(rows))


def _cautious(request: BenchRequest) -> _Cautious:
    setup = load_setup(_CAUTIOUS_DESIGN)
    drawn = studies_of(setup)
    if not isinstance(drawn, DirectionStudies) or not isinstance(drawn.law, DiffusionLaw):
        raise TypeError(f"{_CAUTIOUS_DESIGN}: its people are not cautious")
    model = drawn.law.own
    others = set(_BOUNDARIES) - set(model.boundaries.values())
    boundaries = {f"{one:g}": one for one in others} | dict(model.boundaries)
    draws = Stream(request.seed, "bench caution")
    return _Cautious(
        model=replace(model, boundaries=boundaries),
        people=tuple(person(model.people, draws) for _ in range(request.people)),
        percepts=percepts_of_methods(setup.gun, drawn.methods, drawn.law),
        trials=drawn.planned().trials,
    )


def _points(of: _Cautious, method: str) -> Iterator[CautionPoint]:
    """Both directions are fired as often."""
    for name, boundary in of.model.boundaries.items():
        forward = _means(of, method, name, "forward")
        backward = _means(of, method, name, "backward")
        yield CautionPoint(
            method=method,
            boundary=boundary,
            instruction="" if name[0].isdigit() else name,
            right=(forward[0] + 1.0 - backward[0]) / 2.0,
            time_s=(forward[1] + backward[1]) / 2.0,
        )


def _means(of: _Cautious, method: str, name: str, way: Direction) -> tuple[float, float]:
    """The share of "forward" and the mean time in s, over all people; lapses are among the answers."""
    own = [own_diffusion(of.model, one, of.percepts[method], way, name) for one in of.people]
    found = moments(*zip(*((one.drift, one.boundary, one.start) for one in own), strict=True))
    lapses, decided_s = of.model.lapses, np.mean([one.non_decision_s for one in own]) + np.mean(found.mean_s)
    lapse_s = (lapses.earliest_s + lapses.latest_s) / 2.0
    kept = 1.0 - lapses.rate
    forward = kept * np.mean(found.upper) + lapses.rate / 2.0
    return float(forward), float(kept * decided_s + lapses.rate * lapse_s)


def _of_method(rows: Sequence[CautionPoint]) -> dict[str, list[CautionPoint]]:
    return {name: [one for one in rows if one.method == name] for name in dict.fromkeys(one.method for one in rows)}


def _time_bought(rows: Sequence[CautionPoint], of: _Cautious) -> Iterator[Bought]:
    """What 100 ms more an answer buy those who were told nothing."""
    for method, own in _of_method(rows).items():
        neutral = next(one for one in own if one.instruction == NEUTRAL)
        times, shares = [one.time_s for one in own], [one.right for one in own]
        after = float(np.interp(neutral.time_s + _LONGER_S, times, shares))
        yield Bought(
            more=f"{1e3 * _LONGER_S:.0f} ms an answer",
            where=f"{method}, from {neutral.time_s:.2f} s on",
            costs=f"{_LONGER_S * of.trials:.0f} s a run of {of.trials} trials",
            buys=f"{100.0 * (after - neutral.right):.1f} of 100 answers more that are right: {apa.percent(after)}",
        )


def _panel(rows: Sequence[CautionPoint]) -> TradePanel:
    curves = _of_method(rows)
    top = max(curves.values(), key=lambda own: own[-1].right)
    return TradePanel(
        title="a participant's caution",
        x_label="mean response time [s]",
        y_label="right answers [%]",
        curves=[
            TradeCurve(name=name, place=place, x=[one.time_s for one in own], y=[100.0 * one.right for one in own])
            for place, (name, own) in enumerate(curves.items())
        ],
        points=[NamedPoint(name=one.instruction, x=one.time_s, y=100.0 * one.right) for one in top if one.instruction],
        scales=("linear", "linear"),
    )


def _section(rows: Sequence[CautionPoint], of: _Cautious) -> Section:
    table = Table(
        caption=f"Means of {len(of.people)} synthetic participants, half of the shots forward",
        header=("Method", "Boundary [√s]", "Instruction", "Right", "Mean time [s]"),
        rows=tuple(
            (one.method, f"{one.boundary:g}", one.instruction, apa.percent(one.right), apa.number(one.time_s))
            for one in rows
        ),
    )
    text = (
        "The people are those of `examples/hurry.toml`: a drift by what they feel, and a boundary, which is their "
        "caution. Only the boundary differs between the points of a curve. All of it is a model's guess, of no person."
    )
    return Section(title="Speed against accuracy by caution", paragraphs=(text,), tables=(table,))
