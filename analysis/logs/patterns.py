r"""Patterns that people write in codebooks and column maps, matched in time that grows with the text alone.

They are RE2's (through Arrow), which never goes back in the text: what Python's `re` needs for that, look-around and
back-references, is refused, and \w, \d and \b know ASCII only: \p{L} is any letter.
"""

from __future__ import annotations

import re
from math import prod
from typing import Annotated

import pyarrow as pa
import pyarrow.compute as pc
from pydantic import AfterValidator

_LONGEST, _MOST_REPEATS, _DEEPEST = 500, 100, 20
_COUNTS = re.compile(r"\{(\d*)(?:,(\d*))?\}")
_GROUP = re.compile(r"\\.|\[\^?\]?(?:\\.|[^\]\\])*\]|(?P<group>\((?!\?)|\(\?P?<\w+>)", re.DOTALL)


def _usable(pattern: str) -> str:
    if len(pattern) > _LONGEST:
        raise ValueError(f"is {len(pattern)} characters long (rule: at most {_LONGEST})")
    if pattern.count("(") > _DEEPEST:
        raise ValueError(f"has {pattern.count('(')} groups (rule: at most {_DEEPEST})")
    if _copies(pattern) > _MOST_REPEATS:
        raise ValueError(f"repeats too often (rule: its {{counts}} multiply to at most {_MOST_REPEATS})")
    try:
        holding("", pattern)
    except ValueError as error:  # Arrow's errors are ValueErrors, text that is no Unicode has one too
        said = str(error).removeprefix("Invalid regular expression: ").partition(": (")[0]
        raise ValueError(f"is no regular expression of RE2 ({said})") from error
    return pattern


def _copies(pattern: str) -> int:
    """How often its most repeated part may stand in a pattern when it is written out."""
    return prod(max(int(end[:5] or 1) for end in ends) for ends in _COUNTS.findall(pattern))


Pattern = Annotated[str, AfterValidator(_usable)]
"""A pattern that can be matched in bounded time."""


def groups_in(pattern: str) -> int:
    r"""How many groups a pattern has.

    >>> groups_in(r"^(sub|VP)_(?:\()[(]")
    1
    """
    return sum(found["group"] is not None for found in _GROUP.finditer(pattern))


def holding(text: str, pattern: str) -> bool:
    """Is the pattern in the text, in any case?

    >>> holding("Ein SPIELZEUG für Kinder", "spielzeug.*kind(er)?")
    True
    """
    return bool(pc.match_substring_regex(pa.scalar(text), f"(?i){pattern}").as_py())


def group_in(text: str, pattern: str) -> str | None:
    """What the one group of a pattern matches in the text; `None` if the pattern is not in it.

    >>> group_in("sub-P07_trials.csv", "sub-([A-Za-z0-9]+)_")
    'P07'
    """
    named = _GROUP.sub(lambda found: "(?P<group>" if found["group"] else found[0], pattern)
    found = pc.extract_regex(pa.scalar(text), named).as_py()
    return None if found is None else str(found["group"])
