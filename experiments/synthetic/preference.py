"""Ratings from what is felt: a shot's strength to a person, and how it appeals to them.

    felt   = strength exp(s z),  s = ln(1 + jnd) / 0.954     Weber's law; at a difference of jnd 75 % tell which is more
    appeal = base + gain ln(1 + felt) + person + criterion   Fechner's law, with what differs by person and by rating

The strength is the evidence of a forward shot (`experiments.synthetic.percept`): 0 for a vibration. Methods whose felt
strengths differ by no more than `jnd` of the weaker one are one feeling to that person, who rates them alike; so one
number says how finely people feel and how often they tie. That appeal follows the strength of the direction felt is a
model's guess: the paper does not publish its means.
Sources: Fechner 1860, Elemente der Psychophysik, for both laws; the criterion noise is that of signal detection.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from statistics import NormalDist
from typing import Annotated

from pydantic import Field

from experiments.config.door import Model, Spread
from experiments.design.streams import Stream
from experiments.tasks.questions import Scale, on_scale

Points = Annotated[float, Field(ge=-100, le=100)]
"""Points of the rating scale, and beyond its ends."""


class Appeal(Model):
    """How a shot that is felt appeals; all of its numbers are assumed.

    `base` and `gain` meet the assumed means of `configs/synthetic/preference.toml` to 0.2, `jnd` the published 2 of 14
    who tied, and `criterion_sd` the published F in half of all studies. Points of the scale; `jnd` a Weber fraction.
    """

    base: Points = 2.3
    gain: Annotated[float, Field(ge=0, le=100)] = 4.9
    jnd: Annotated[float, Field(ge=0, le=10)] = 0.33
    person_sd: Spread = 0.6
    criterion_sd: Spread = 1.9


def jnd_in_sds() -> float:
    """The difference of which 75 % tell the stronger, in SDs of one felt strength.

    >>> round(jnd_in_sds(), 4)
    0.9539
    """
    return math.sqrt(2.0) * NormalDist().inv_cdf(0.75)


def felt_ratings(law: Appeal, scale: Scale, strengths: Mapping[str, float], draws: Stream) -> dict[str, float]:
    """One person's ratings of methods of these strengths (at least 0), kept to the scale and its grain.

    Two draws a method are always made, in the order of their names, so a change of one number moves no other value.
    """
    person, spread = law.person_sd * draws.normal(), math.log1p(law.jnd) / jnd_in_sds()
    names = sorted(strengths)
    felt = {name: strengths[name] * math.exp(spread * draws.normal()) for name in names}
    criterion = {name: law.criterion_sd * draws.normal() for name in names}
    ratings: dict[str, float] = {}
    for alike in feelings(felt, law.jnd):
        mean = sum(felt[name] for name in alike) / len(alike)
        appeal = law.base + law.gain * math.log1p(mean) + person + criterion[alike[0]]
        ratings |= dict.fromkeys(alike, on_scale(appeal, scale))
    return ratings


def feelings(felt: Mapping[str, float], jnd: float) -> list[list[str]]:
    """The methods by what they feel like, weakest first: alike is what lies within `jnd` of the weakest of its kind.

    >>> feelings({"a": 1.0, "b": 0.0, "c": 1.2, "d": 1.4}, 0.25)
    [['b'], ['a', 'c'], ['d']]
    """
    kinds: list[list[str]] = []
    for name in sorted(felt, key=lambda name: felt[name]):
        if kinds and felt[name] <= felt[kinds[-1][0]] * (1.0 + jnd):
            kinds[-1].append(name)
        else:
            kinds.append([name])
    return kinds
