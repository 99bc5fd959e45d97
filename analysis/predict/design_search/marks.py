"""A design search's findings as what its figures draw."""

from __future__ import annotations

from typing import Any

import numpy as np

from analysis.predict.design_search.figures import Mark
from analysis.predict.design_search.maps import Field

Facts = dict[str, Any]


def field_of(found: Facts, plane: Facts) -> Field:
    """A plane of designs, for a map."""
    return Field(
        pulse_s=plane["pulse_s"],
        friction_N=np.array(found["axes"]["friction_N"]),
        voltage_V=np.array(found["axes"]["voltage_V"]),
        status=np.array(plane["status"]),
        predicted=np.array(plane["predicted"], dtype=np.float64),
        shooting_rate_Hz=np.array(plane["shooting_rate_Hz"], dtype=np.float64),
        beyond=np.array([words is not None for words in plane["limit_of_voltage"]]),
    )


def with_pulse(one: Facts, pulse_s: float) -> str:
    """A method's name; with its pulse, if that is another than the map's."""
    return str(one["name"] if one["pulse_s"] == pulse_s else f"{one['name']} (pulse {1e3 * one['pulse_s']:.3g} ms)")


def felt_methods(found: Facts, *, swept: bool = False) -> list[Facts]:
    """The gun's own methods that have a prediction; those alone that the sweep could come upon, if asked."""
    return [one for one in found["own"] if one["predicted"] is not None and (one["swept"] or not swept)]


def own_marks(found: Facts, *, swept: bool = False) -> list[Mark]:
    """The same by their names."""
    return [mark_of(one["name"], one) for one in felt_methods(found, swept=swept)]


def best_mark(found: Facts) -> Mark | None:
    """The best design, if one may be proposed."""
    best = found["best"]
    return None if best is None else mark_of(f"best at {found['rate_above_Hz']:g} Hz or faster", best)


def mark_of(name: str, one: Facts) -> Mark:
    """A design under a name; without known limits its prediction stands for them."""
    return Mark(
        name=name,
        friction_N=one["friction_N"],
        voltage_V=one["voltage_V"],
        shooting_rate_Hz=one["shooting_rate_Hz"],
        predicted=one["predicted"],
        ci_low=one["predicted"] if one["ci_low"] is None else one["ci_low"],
        ci_high=one["predicted"] if one["ci_high"] is None else one["ci_high"],
    )
