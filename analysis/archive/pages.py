"""What an archive says of itself: its page, the Methods section of its designs, and how it is to be cited. Pure."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from analysis.archive.contents import CONTENTS, MEANINGS, Entry
from analysis.archive.manifest import MANIFEST_FILE
from analysis.report.section import Section, Table
from device.messages import how_many
from experiments.config.setup import GunConfig
from experiments.design.config import DesignConfig
from experiments.design.methods_section import methods_section
from experiments.design.planned import runs_of_groups
from experiments.record.journal import ShownLanguage

CITATION = "CITATION.cff"


@dataclass(frozen=True, slots=True, kw_only=True)
class ArchivedDesign:
    """A design with the gun that it ran on, who did it, and who of them in another language than the design's.

    `synthetic`: of so many participants simulations answered; `stopped`: the runs of so many did not come to their end;
    `differs`: what the setup has otherwise than the first of its experiment.
    """

    design: DesignConfig
    gun: GunConfig
    participants: tuple[str, ...]
    spoken: tuple[ShownLanguage, ...] = ()
    synthetic: int = 0
    stopped: int = 0
    differs: str = ""


_README = """# {title}

The data of a study with a haptic gun, written by Recoil {version} (`recoil export archive`). All tables and statistics
in it are made from the journals in it; `recoil verify` of this folder checks every file and makes them again. Without
Recoil, `sha256sum --check {manifest}` checks the files.

| file | holds |
| --- | --- |
| `results/` | each run's journal, redacted, and the tables that it makes; what the columns mean |
| `analysis/` | statistics, tables of results, figures and report |
| `bids/` | the same runs as a BIDS data set |
| `datapackage.json`, `schemas/` | every table as a Frictionless data package, with types, ranges and meanings |
| `METHODS.md` | the design in the words of a Methods section |
| `preregistration/` | what the study was frozen as before its first run, if it was; journals name its hash |
| `{contents}` | every run of the study, those that are left out too, with the reason |
| `CITATION.cff` | how to cite the data |
| `archive.json` | how the archive was made, for `recoil verify` |
| `{manifest}` | the SHA-256 of every other file |

## What is in it

{counts}
{synthetic}
## What is redacted

{redacted}
The first line of each journal holds, as `redacted_from`, the SHA-256 of the original's first line and of its last,
which ends the original's own chain of hashes: who keeps the originals can show that nothing else was changed.
"""
_HIDDEN = """Participants stand under their codes. In the journals and all that is made from them

- {words}
- dates and times are moved: each participant's first run begins on 2000-01-01 at 00:00 UTC, and what lies between two
  moments of a participant is as it was; the computer's and the gun's own clocks begin at 0 with each run;
- causes of faults, which may name ports and folders, are `[redacted]`, and files of configs stand without their
  folders;
- ages above 89 are given as 89; the study's register with its reasons for exclusions is not here.

Designs and their texts, flags that the experimenter set on trials, seeds, versions and the gun's serial number are as
they were. So are preregistrations, with their dates, the reasons of amendments and the codes of who had begun by then;
why rules leave somebody out is never frozen.
"""
_NO_WORDS = """\
what people wrote (descriptions, notes, reasons) is `[redacted]`, as it might say who someone is; what was
  empty is empty;"""
_WORDS = "what people wrote (descriptions, notes, reasons) is as it was: the archive was made with `--free-text`;"
_SYNTHETIC = """
{who} participants are synthetic: a simulation answered, not a person (column `data` of `contents.csv`).
"""


def archive_page(title: str, version: str, entries: Sequence[Entry], *, free_text: bool) -> bytes:
    """The page of an archive: what lies where, who is in it and who is not, what is redacted and why."""
    kinds = {one.kind for one in entries if one.archived} - {None}
    return _README.format(
        title=title,
        version=version,
        manifest=MANIFEST_FILE,
        contents=CONTENTS,
        counts="\n".join(_counts(entries)),
        synthetic=_SYNTHETIC.format(who="Some" if len(kinds) > 1 else "All") if "synthetic" in kinds else "",
        redacted=_HIDDEN.format(words=_WORDS if free_text else _NO_WORDS),
    ).encode()


def _counts(entries: Sequence[Entry]) -> Iterator[str]:
    """How many runs are in which state, as Markdown."""
    people = {one.participant_id for one in entries if one.archived}
    yield f"{how_many(len(people), 'participant')}.\n"
    yield f"| {' | '.join(_HEADER)} |"
    yield "| --- | --- | --- | --- |"
    yield from (f"| {' | '.join(row)} |" for row in _states(entries))


_HEADER = ("experiment", "state", "runs", "means")


def _states(entries: Sequence[Entry]) -> Iterator[tuple[str, ...]]:
    """How many runs of each experiment are in which state."""
    counts = Counter((one.experiment, one.state) for one in entries)
    order = {state: place for place, state in enumerate(MEANINGS)}
    for (experiment, state), count in sorted(counts.items(), key=lambda pair: (pair[0][0], order[pair[0][1]])):
        yield experiment or "–", state, str(count), MEANINGS[state]


def contents_section(entries: Sequence[Entry]) -> Section:
    """The same for the report, which is of the runs in the archive alone."""
    said = f"This report is of the runs in the archive; {CONTENTS} names each run of the study, by its participant."
    caption = "Runs of the study, those that are left out too"
    table = Table(caption=caption, header=_HEADER, rows=tuple(_states(entries)))
    return Section(title="Runs in the archive, and left out", paragraphs=(said,), tables=(table,))


def methods(designs: Iterable[ArchivedDesign]) -> bytes:
    """The Methods section of each design, with how many did it."""
    return "\n".join(line for one in designs for line in _method(one)).encode()


def _method(one: ArchivedDesign) -> Iterator[str]:
    people = how_many(len(one.participants), "participant")
    yield f"# {one.design.title}\n"
    yield f"Experiment `{one.design.design}`, {people}{_simulated(one)}; gun: {one.gun.title}.\n"
    if one.stopped:
        which = (
            "1 run was stopped before its" if one.stopped == 1 else f"{one.stopped:,} runs were stopped before their"
        )
        yield f"{which} end; the archive has what was answered up to there.\n"
    if one.differs:
        yield f"What differs from the first setup of this experiment: {one.differs}.\n"
    for paragraph in methods_section(one.design, runs_of_groups(one.design, one.gun), one.gun.labels):
        yield f"{paragraph}\n"
    yield from _translations(one)


def _simulated(one: ArchivedDesign) -> str:
    """How many of the participants are nobody."""
    if not one.synthetic:
        return ""
    who = "all" if one.synthetic == len(one.participants) else f"{one.synthetic:,}"
    return f", {who} of them synthetic (a simulation answered, not a person)"


def _translations(one: ArchivedDesign) -> Iterator[str]:
    """Who was spoken to in another language, and whether anybody who speaks it has checked the words."""
    found = Counter((shown.code, shown.name, bool(shown.checked_by)) for shown in one.spoken)
    for (code, name, checked), people in sorted(found.items()):
        by = "checked by a native speaker" if checked else "which no native speaker had checked"
        yield f"{people} of {len(one.participants)} saw and heard all of it in a translation, {code} ({name}), {by}.\n"


def citation(title: str, version: str) -> bytes:
    """A `CITATION.cff` for the author to fill in. Reference: Citation File Format 1.2.0, https://citation-file-format.github.io"""
    values: Mapping[str, str] = {"title": json.dumps(title, ensure_ascii=False), "version": json.dumps(version)}
    return _CITATION.format(**values).encode()


_CITATION = """# For the authors: put this file, filled in, into the study's folder, and export the archive anew.
cff-version: 1.2.0
message: "If you use these data, please cite them as below."
type: dataset
title: {title}
authors:
  - family-names: "FAMILY NAME"
    given-names: "GIVEN NAMES"
#   orcid: https://orcid.org/0000-0000-0000-0000
#   affiliation: "INSTITUTION"
# license: CC-BY-4.0
# date-released: 2000-01-01
# doi: 10.5281/zenodo.0000000
references:
  - type: software
    title: "Recoil"
    version: {version}
    authors:
      - name: "Recoil maintainers"
"""
