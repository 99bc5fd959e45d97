"""The unit that ends the name of a number: one list, for configs, tables, pages and exports."""

from __future__ import annotations

import re
from typing import NamedTuple

_UNITS = ("V_s_m", "m_s2", "N_m", "N_A", "m_s", "ohm", "Hz", "kg", "V", "s", "N", "A", "H", "m")
"""As names have them; a longer one before those that end it."""
_NAME = re.compile(rf"(.+?)_({'|'.join(_UNITS)})(?:_([0-9]+))?")
_WRITTEN = {"V_s_m": "V s/m", "ohm": "Ω"}


class PartedName(NamedTuple):
    """A name's words, its unit as it ends the name, empty without one, and the interval that is counted behind it."""

    words: str
    unit: str
    interval: str


def parted(name: str) -> PartedName:
    """What a number's name says.

    >>> parted("voltage_V"), parted("stiffness_N_m").unit, parted("voltage_V_1").interval, parted("pad_count").unit
    (PartedName(words='voltage', unit='V', interval=''), 'N_m', '1', '')
    """
    found = _NAME.fullmatch(name)
    words, unit, interval = found.groups("") if found else (name, "", "")
    return PartedName(words.replace("_", " "), unit, interval)


def written_unit(unit: str) -> str:
    """A unit as it is written: `N/m` for N_m.

    >>> written_unit("N_m"), written_unit("ohm"), written_unit("V")
    ('N/m', 'Ω', 'V')
    """
    return _WRITTEN.get(unit, unit.replace("_", "/"))


def long_name(name: str) -> str:
    """A name as a title, without its unit, which is told elsewhere.

    >>> long_name("exposure_s"), long_name("response_time_valid"), long_name("voltage_V_1"), long_name("pad_count")
    ('Exposure', 'Response time valid', 'Voltage 1', 'Pad count')
    """
    words, _, interval = parted(name)
    return f"{words} {interval}".strip().capitalize()
