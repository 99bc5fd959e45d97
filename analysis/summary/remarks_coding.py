r"""Free descriptions coded with a codebook: how many participants said what, counted from the codes.

```
hand_coded = "coded.csv"            # optional: participant_id,code; codes that somebody gave by hand

[[codes]]
code = "toy"
label = "It feels like a toy for children."
method = "vibration"                # optional: only in descriptions of this method
words = ["toy", "children"]         # any of these words, whole and in any case
pattern = "toy|child(ren)?"         # or a regular expression (RE2's), in any case
participants = ["P03", "P07"]       # or coded by hand, here
```

A participant counts once a code, however often they said it; percentages are of all analysed participants. Words and
patterns know nothing of negation or irony: read what they found before you publish it. RE2 matches in time that grows
with the text alone; it has no look-around and no back-references, and its \w and \b know ASCII only (\p{L} is any
letter).
"""

from __future__ import annotations

import csv
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Self

from pydantic import Field, model_validator

from analysis.logs.patterns import Pattern, holding
from analysis.report import apa
from analysis.report.section import Section, Table
from device.messages import how_many
from experiments.config.door import ConfigError, Model, load, why_unread

_NonEmpty = Annotated[str, Field(min_length=1)]


class RemarkCode(Model):
    """One code: what it is called, and how it is recognised."""

    code: Annotated[str, Field(pattern=r"^[A-Za-z0-9_-]{1,40}$")]
    label: _NonEmpty
    method: _NonEmpty | None = None
    words: tuple[_NonEmpty, ...] = ()
    pattern: Pattern | None = None
    participants: tuple[_NonEmpty, ...] = ()

    def found_in(self, text: str) -> bool:
        """Is one of the words, or the pattern, in the text?"""
        whole = (rf"\b{re.escape(word)}\b" for word in self.words)
        if any(re.search(word, text, re.IGNORECASE) for word in whole):
            return True
        return self.pattern is not None and holding(text, self.pattern)


class Codebook(Model):
    """The codes, each once."""

    codes: Annotated[tuple[RemarkCode, ...], Field(min_length=1)]
    hand_coded: _NonEmpty | None = None

    @model_validator(mode="after")
    def _codes_are_distinct(self) -> Self:
        names = [code.code for code in self.codes]
        doubled = sorted({name for name in names if names.count(name) > 1})
        if doubled:
            raise ValueError(f"codes {', '.join(doubled)} stand there more than once; name each once")
        return self


@dataclass(frozen=True, slots=True, kw_only=True)
class WrittenRemark:
    """What a participant wrote of a method."""

    participant: str
    method: str
    text: str


@dataclass(frozen=True, slots=True, kw_only=True)
class CodeCount:
    """Who said it; `share` is of all participants."""

    code: str
    label: str
    method: str | None
    participants: tuple[str, ...]
    count: int
    share: float


@dataclass(frozen=True, slots=True, kw_only=True)
class CodedRemarks:
    """All codes with their counts; `described` participants wrote something, `uncoded` remarks got no code."""

    n: int
    described: int
    remarks: int
    uncoded: int
    codes: tuple[CodeCount, ...]


def load_codebook(path: Path) -> Codebook:
    """A codebook, its table of hand-given codes read in. `ConfigError` with file, place and rule."""
    book = load(Codebook, path)
    if book.hand_coded is None:
        return book
    given = list(_hand_coded(path.parent / book.hand_coded, {code.code for code in book.codes}))
    codes = [
        code.model_copy(
            update={"participants": (*code.participants, *(who for who, name in given if name == code.code))}
        )
        for code in book.codes
    ]
    return book.model_copy(update={"codes": tuple(codes)})


def _hand_coded(path: Path, known: set[str]) -> Iterable[tuple[str, str]]:
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            reader = csv.DictReader(file, strict=True)
            rows = list(reader)
    except (OSError, ValueError, csv.Error) as error:
        raise ConfigError(
            f"{path}: cannot be read ({why_unread(error)}); the codebook's key hand_coded names it"
        ) from error
    if list(reader.fieldnames or ()) != ["participant_id", "code"]:
        raise ConfigError(f"{path}: line 1: columns are {reader.fieldnames}; they must be participant_id, code")
    for number, row in enumerate(rows, start=2):
        if row["code"] not in known:
            raise ConfigError(f"{path}: line {number}: code {row['code']!r} is not in the codebook")
        yield row["participant_id"], row["code"]


def code_remarks(remarks: Sequence[WrittenRemark], participants: Sequence[str], book: Codebook) -> CodedRemarks:
    """How many of `participants` have each code, from their remarks and from the codes given by hand.

    `ValueError` without participants, or for a code given by hand to somebody who is not among them.
    """
    people = set(participants)
    strangers = sorted({who for code in book.codes for who in code.participants} - people)
    if not people or strangers:
        raise ValueError(f"codes are given to {', '.join(strangers)}, not analysed" if strangers else "no participants")
    mine = [remark for remark in remarks if remark.participant in people and remark.text.strip()]
    return CodedRemarks(
        n=len(people),
        described=len({remark.participant for remark in mine}),
        remarks=len(mine),
        uncoded=sum(not any(_has(remark, code) for code in book.codes) for remark in mine),
        codes=tuple(_count(code, mine, participants) for code in book.codes),
    )


def _has(remark: WrittenRemark, code: RemarkCode) -> bool:
    return code.method in {None, remark.method} and code.found_in(remark.text)


def _count(code: RemarkCode, remarks: Sequence[WrittenRemark], participants: Sequence[str]) -> CodeCount:
    said = {remark.participant for remark in remarks if _has(remark, code)} | set(code.participants)
    who = tuple(person for person in dict.fromkeys(participants) if person in said)
    share = len(who) / len(set(participants))
    return CodeCount(
        code=code.code, label=code.label, method=code.method, participants=who, count=len(who), share=share
    )


def coding_section(coded: CodedRemarks) -> Section:
    """The counts as a section of a report."""
    rows = tuple(
        (one.label, one.code, one.method or "any", str(one.count), apa.percent(one.share)) for one in coded.codes
    )
    people = how_many(coded.n, "participant")
    text = (
        f"{coded.described} of {people} described something, in {coded.remarks} remarks; {coded.uncoded} "
        "of these got no code from their words. A participant counts once a code; percentages are of all "
        f"{people}."
    )
    header = ("Remark", "Code", "Method", "Participants", "Share")
    return Section(
        title="Coded remarks",
        paragraphs=(text,),
        tables=(Table(caption="How many participants said what, by the codebook", header=header, rows=rows),),
    )
