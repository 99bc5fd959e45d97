"""The words of the figures: methods as the paper prints them, and its marks of significance."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping
from typing import Any

_DISPLAY_NAMES = {
    "vibration": "Vibration",
    "asymmetric-1": "Asymmetric Force I",
    "asymmetric-2": "Asymmetric Force II",
}


def display_name(method: str) -> str:
    """The method's name in print; a method the paper does not know keeps its own.

    >>> display_name("asymmetric-2"), display_name("ramp")
    ('Asymmetric Force II', 'ramp')
    """
    return _DISPLAY_NAMES.get(method, method)


def wrapped(method: str) -> str:
    r"""The method's name in short lines, broken at spaces and hyphens.

    >>> wrapped("asymmetric-2"), wrapped("ramp-up-slowly")
    ('Asymmetric\nForce II', 'ramp-up-\nslowly')
    """
    return "\n".join(textwrap.wrap(display_name(method), 10))


def named(text: str) -> str:
    """`text` with the paper's methods under the paper's names.

    >>> named("asymmetric-2 above vibration")
    'Asymmetric Force II above Vibration'
    """
    for method, name in _DISPLAY_NAMES.items():
        text = text.replace(method, name)
    return text


def stars(p: float | None) -> str:
    """Significance as the paper marks it.

    >>> stars(0.0004), stars(0.004), stars(0.04), stars(0.4)
    ('***', '**', '*', 'n.s.')
    """
    if p is None:
        return "n.s."
    return "***" if p < 0.001 else "**" if p < 0.01 else "*" if p < 0.05 else "n.s."


def people(found: Mapping[str, Any]) -> str:
    """How many took part in an experiment of `statistics.json`; said so if nobody of flesh answered.

    >>> people({"n": 14, "origin": {"answers": {"synthetic": 840}}}), people({"n": 1})
    ('14 synthetic participants', '1 participant')
    """
    synthetic = "synthetic " if set(found.get("origin", {}).get("answers", ())) == {"synthetic"} else ""
    return f"{found['n']:,} {synthetic}participant{'' if found['n'] == 1 else 's'}"
