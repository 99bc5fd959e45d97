"""What `recoil power` is asked for, checked at the door: config, methods, trials, and lists of numbers."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import Any

from analysis.predict.power.studies import DrawnConfig
from experiments.config.door import ConfigError
from experiments.config.setup import Setup
from experiments.direction.config import DirectionConfig
from experiments.load import find, load_setup
from experiments.preference.config import PreferenceConfig

_LARGEST_EFFECT = 10.0
FELT = "felt"
"""The observer of people who answer from what the gun does."""
_LAWS = {"direction": ("rates", FELT), "preference": ("ratings",)}
"""The observers that studies can be drawn from."""


class GridError(ConfigError):
    """A grid that cannot be worked out; the message names option, value and rule."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PowerRequest:
    """What the command line asks for. Lists are text, as in `8,10,14-20`."""

    config: str
    participants: str | None = None
    trials: str | None = None
    methods: tuple[str, ...] = ()
    effects: str | None = None
    studies: int = 10_000
    target: float = 0.8
    null: bool = False
    seed: int = 1
    paper: str = "paper"


def check_scalars(request: PowerRequest) -> None:
    """`GridError` for a target that is no share, and for an effect of people who feel none."""
    if not 0.0 < request.target < 1.0:
        raise GridError(f"--target {request.target:g}: must lie between 0 and 1, such as 0.8")
    if request.null and request.effects is not None:
        raise GridError(f"--null has no effect at all; leave --effect {request.effects} out")


def checked_setup(name: str) -> Setup[Any]:
    """The config with its gun, if its synthetic participants follow a law that studies can be drawn from."""
    setup = load_setup(name)
    config = setup.config
    observer, laws = config.synthetic.observer, _LAWS.get(config.experiment, ())
    if not isinstance(config, DirectionConfig | PreferenceConfig) or observer not in laws:
        drawn = " or ".join(f'"{law}"' for law in laws)
        raise GridError(f'{find(name)}: synthetic.observer = "{observer}" has no power; studies are drawn from {drawn}')
    if isinstance(config, DirectionConfig) and not config.design.forward_per_session:
        raise GridError(f"{find(name)}: design.forward_per_session = 0; the planned analysis is of forward trials")
    return setup


def method_sets_of(asked: tuple[str, ...], config: DrawnConfig) -> list[tuple[str, ...]]:
    """The sets of methods to compare: the config's own unless some are named."""
    known, sets = config.design.methods, []
    for text in asked or (",".join(known),):
        names = [name.strip() for name in text.split(",")]
        strangers = [name for name in names if name not in known]
        if strangers or len(set(names)) != len(names) or len(names) < 2:
            raise GridError(f"--methods {text}: must be two or more different ones of {', '.join(known)}")
        sets.append(tuple(method for method in known if method in names))
    return list(dict.fromkeys(sets))


def trials_of(asked: str | None, config: DrawnConfig) -> list[int]:
    """The trials of one method: the config's own unless some are named."""
    if isinstance(config, PreferenceConfig):
        if asked is not None:
            raise GridError(f"--trials {asked}: {config.title!r} has one trial a method; leave the option out")
        return [1]
    design = config.design
    if asked is None:
        return [design.trials_per_session]
    whole = design.trials_per_session // math.gcd(design.trials_per_session, design.forward_per_session)
    step = math.lcm(design.trials_per_set * max(1, len(design.instructions)), whole)
    found = whole_numbers(asked, "--trials", 1, 10_000)
    uneven = [trials for trials in found if trials % step]
    if uneven and "-" not in asked:
        raise GridError(
            f"--trials {asked}: {uneven[0]} is no multiple of {step}, so it makes no sets of {design.trials_per_set} "
            f"with forward and backward trials as the config has them ({design.forward_per_session} to "
            f"{design.backward_per_session})"
        )
    fitting = [trials for trials in found if trials % step == 0]
    if not fitting:
        raise GridError(f"--trials {asked}: holds no multiple of {step}")
    return fitting


def whole_numbers(text: str, option: str, low: int, high: int) -> list[int]:
    """Whole numbers and ranges, in order and once each. `GridError` for others, or outside `low`..`high`.

    >>> numbers("14, 8-10", "--participants", 2, 999)
    [8, 9, 10, 14]
    """
    found = set[int]()
    for part in text.split(","):
        match = re.fullmatch(r"\s*([0-9]{1,9})\s*(?:-\s*([0-9]{1,9})\s*)?", part)
        if not match:
            raise GridError(f"{option} {text}: {part.strip()!r} is no whole number and no range such as 8-20")
        first, last = int(match[1]), int(match[2] or match[1])
        if not low <= first <= last <= high:
            raise GridError(f"{option} {text}: {part.strip()} must be from {low} to {high}, ranges upwards")
        found |= set(range(first, last + 1))
    return sorted(found)


def factors(text: str) -> list[float]:
    """Effect factors, in order and once each. `GridError` for what is not a number from 0 to 10.

    >>> factors("1,0.5")
    [0.5, 1.0]
    """
    found = set[float]()
    for part in text.split(","):
        try:
            value = float(part)
        except ValueError:
            value = math.nan
        if not 0.0 <= value <= _LARGEST_EFFECT:
            raise GridError(f"--effect {text}: {part.strip()!r} must be a number from 0 (none) to {_LARGEST_EFFECT:g}")
        found.add(value)
    return sorted(found)
