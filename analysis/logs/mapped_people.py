"""Whose logs another program's rows are: a code in a column, a part of one, or a part of the file's name."""

from __future__ import annotations

import hashlib
import re
from collections import Counter
from collections.abc import Collection, Iterable, Mapping, Sequence
from functools import lru_cache
from typing import Annotated, Self

from pydantic import AfterValidator, Field, model_validator

from analysis.logs.files import BadLogError
from analysis.logs.patterns import Pattern, group_in, groups_in
from experiments.config.door import Model
from experiments.record import tables
from experiments.record.names import is_code

ShortText = Annotated[str, Field(min_length=1, max_length=500)]


def _with_one_group(pattern: str) -> str:
    groups = groups_in(pattern)
    if groups != 1:
        raise ValueError(f"has {groups} groups; it must have one, which is the code")
    return pattern


_CodePattern = Annotated[Pattern, Field(min_length=1), AfterValidator(_with_one_group)]


class ParticipantMapping(Model):
    """Where the participant's code stands: in a column, all of it or the one group of a pattern, or in file names."""

    column: ShortText | None = None
    pattern: _CodePattern | None = None
    file_name: _CodePattern | None = None

    @model_validator(mode="after")
    def _one_of_both(self) -> Self:
        if (self.column is None) == (self.file_name is None):
            raise ValueError("give either `column` or `file_name`, not both and not none")
        if self.pattern is not None and self.column is None:
            raise ValueError("`pattern` goes with `column`; `file_name` is a pattern itself")
        return self


def code_in(text: str, where: ParticipantMapping, known: Mapping[str, str], line: int) -> str:
    """The code in a cell, or in a file's name; `known` are codes of the map's own. `BadLogError`: there is none."""
    if where.column is None:
        code = _group(where.file_name or "()", text)
        if code is None:
            rule = f"(rule: participant.file_name = {where.file_name!r} finds it)"
            raise BadLogError(f"the name has no participant's code {rule}")
        return known.get(code, code)
    if text == tables.MISSING and text not in known:
        raise BadLogError("the participant's code is empty (rule: every row says whose it is)", line, where.column)
    code = text if where.pattern is None or text in known else _group(where.pattern, text)
    if code is None:
        rule = f"(rule: participant.pattern = {where.pattern!r} finds it; [values.participant] names who does not fit)"
        raise BadLogError(f"{text!r} has no participant's code {rule}", line, where.column)
    return known.get(code, code)


@lru_cache(maxsize=4096)
def _group(pattern: str, text: str) -> str | None:
    """What the one group of a pattern finds in a text, if it finds something; rows of one person say the same."""
    return group_in(text, pattern) or None


def check_person(code: str, where: ParticipantMapping, line: int, cells: Sequence[str], alike: Collection[str]) -> None:
    """`BadLogError` if a code is none, or if the map made it of several people's `cells`; `line` is their first.

    `alike`: the letters and digits that several codes of the file come to.
    """
    if not is_code(code):
        rule = "(rule: 1 to 32 letters or digits, A-Z, a-z, 0-9)"
        raise BadLogError(f"{code!r} is not a code {rule}; {_remedy(code, where, alike)}", line, where.column)
    several = list(dict.fromkeys(cells))
    if len(several) > 1:
        by = f"participant.pattern = {where.pattern!r}" if where.pattern else "[values.participant]"
        both = f"{several[0]!r} and {several[1]!r} are both code {code!r} by {by}"
        rule = "(rule: one code a participant; list each name of who has several under [values.participant])"
        raise BadLogError(f"{both} {rule}", line, where.column)


def unlisted(names: Sequence[str], listed: Mapping[str, str]) -> Sequence[str]:
    """The names that a code was made of, none where the map lists each of them: so a lab says they are one person."""
    return () if all(name in listed for name in names) else names


def same_letters(codes: Iterable[str]) -> frozenset[str]:
    """What several of a file's codes come to once they have letters and digits alone, in small letters.

    >>> sorted(same_letters(["A-1", "A_1", "B_1", "a1"]))
    ['a1']
    """
    counts = Counter(_plain(code).casefold() for code in {*codes})
    return frozenset(plain for plain, count in counts.items() if count > 1)


def _plain(code: str) -> str:
    return re.sub("[^A-Za-z0-9]", "", code)


def _own_code(code: str, alike: Collection[str]) -> str:
    """A code for a person whose own is none, which nobody else of the file has; what letters it lacks its hash tells.

    >>> _own_code("VP_02", ()), _own_code("VP_02", ["vp02"]), _own_code("李娜", ())
    ('VP02', 'VP02x2d8572', 'Px6e9c21')
    """
    plain = _plain(code)
    if code.isascii() and is_code(plain) and plain.casefold() not in alike:
        return plain
    return f"{plain[:_KEPT] or 'P'}x{hashlib.sha256(code.encode()).hexdigest()[:6]}"


_KEPT = 20


def _remedy(code: str, where: ParticipantMapping, alike: Collection[str]) -> str:
    """How a map makes a code of a text that is none."""
    listed = f'[values.participant] {code!r} = "{_own_code(code, alike)}" gives {code!r} a code of their own'
    if where.file_name or where.pattern:
        return f"let the pattern's group hold letters and digits alone, or {listed}"
    parts = re.search(r"^(.*?)([0-9]+|[A-Za-z0-9]+)$", code)
    if parts is None:
        return listed
    kind = r"\d" if parts[2].isdecimal() else "[A-Za-z0-9]"
    pattern = f"[participant] pattern = '{re.escape(parts[1])}({kind}+)'"
    return f"{pattern} takes a part of it for the code, or {listed}"
