"""What an exported data set says of itself: its tasks, its columns, its README."""

from __future__ import annotations

import re
from typing import Any

from experiments.record.columns import Column

ANSWERED_BY = {"direction": "response_source", "preference": "rating_by"}
"""The column that says whose hand gave the answer; empty where there is none."""

TASKS = {
    "direction": "Two-alternative forced choice: which way did the gun shoot? One session a rendering method, in sets "
    "of trials; the direction of a trial is the one the gun pointed and shot.",
    "preference": "How do you like it? Each rendering method is presented and then rated from 0 (dislike very much) to "
    "10 (like very much).",
}

_LEVELS = {
    "participant": "the participant's own hand",
    "experimenter": "the experimenter's hand",
    "synthetic": "a synthetic participant: a simulation, no person",
    "0": "no",
    "1": "yes",
}
"""What levels mean that do not say it themselves."""

_FORMATS = {"integer": "integer", "number": "number", "flag": "integer", "text": "string", "level": "string"}

_MORE: dict[str, dict[str, Any]] = {
    "rating": {"Minimum": 0, "Maximum": 10},
    "onset": {
        "Format": "number",
        "Units": "s",
        "Description": "first pulse of the last presentation, counted from the earliest such pulse of this run; "
        "n/a if none. The log has date and time; they are left out here",
    },
}
"""What the data dictionary does not say, or says of what stands in the log and not here."""

_CLEANED = "line breaks and tabs are blanks, double quotes single ones; a leading = + - @ or ' has a ' in front"

PARTICIPANTS: dict[str, dict[str, Any]] = {
    "participant_id": {
        "LongName": "Participant",
        "Description": "sub- and the participant's code, as in the names of folders and files",
        "Format": "string",
    },
    "species": {
        "LongName": "Species",
        "Description": "species of a person who took part; n/a for a synthetic participant, or without any answer",
        "Format": "string",
    },
    "age": {
        "LongName": "Age",
        "Description": "age in whole years when joining; 89 stands for 89 and above; n/a if it was not asked",
        "Format": "integer",
        "Units": "year",
        "Maximum": 89,
    },
    "sex": {
        "LongName": "Sex",
        "Description": "as the participant said; n/a if it was not asked or not disclosed",
        "Format": "string",
        "Levels": {"female": "female", "male": "male", "other": "other"},
    },
    "handedness": {
        "LongName": "Handedness",
        "Description": "as the participant said; n/a if it was not asked",
        "Format": "string",
        "Levels": {"right": "right-handed", "left": "left-handed", "ambidextrous": "uses both hands alike"},
    },
    "synthetic": {
        "LongName": "Synthetic participant",
        "Description": "whether a simulation gave any of the answers; n/a without any answer",
        "Format": "boolean",
        "Levels": {"true": "a simulation answered", "false": "a person answered every time"},
    },
}
"""The columns of `participants.tsv`."""

_README = """# {people}{synthetic}

A data set of psychophysics experiments on a haptic gun, written by Recoil (`recoil export bids`) from its logs. It
keeps to the Brain Imaging Data Structure: one folder a participant, one table a run, and beside them the JSON files
that describe every column.

- Participants and tasks stand in the names of the files: `sub-<code>` and `task-<experiment>`.
- `session` is a block of trials with one rendering method. It is no session in the sense of BIDS.
- One row a planned trial, also those that were not reached. `n/a` says that there is no value; 0 is a value.
- Participants who were excluded, practice runs and logs that break a rule are not in it.
- For privacy there are no dates (`onset` counts from the first pulse of the run), and ages above 89 are given as 89.
- {text}
- Where `gun` says `simulated`, a simulated gun rendered the shots.

Please add what a program cannot know to `dataset_description.json`: Authors, License, Funding, EthicsApprovals. Keys
that are added to it, or to a `task-*_beh.json` (Instructions, InstitutionName), and a Name that was changed stay when
the data set is exported again; everything else, this page too, is then written anew.
"""
_LEFT_OUT = "Free text (`comment`, `note`) is left out: it might say who someone is."
_LEFT_IN = (
    "Free text (`comment`, `note`) is in it: read it before you pass the data set on, it might say who someone is."
)


def described(column: Column, name: str) -> dict[str, Any]:
    """A column as BIDS describes it, from the data dictionary. `name` is what it is called in the data set."""
    text = re.sub(r"\bempty\b", "n/a", column.description).replace("`", "'")
    found = {
        "LongName": long_name(name),
        "Description": f"{text}; {_CLEANED}" if name in ("comment", "note") else text,
        "Format": _FORMATS[column.type],
        "Units": column.unit,
        "Levels": {level: _LEVELS.get(level, level) for level in column.levels},
    }
    return {key: value for key, value in (found | _MORE.get(name, {})).items() if value not in ("", {})}


def long_name(name: str) -> str:
    """A column's name in words: the unit at its end is told elsewhere.

    >>> long_name("exposure_s"), long_name("response_time_valid")
    ('Exposure', 'Response time valid')
    """
    return name.removesuffix("_s").replace("_", " ").capitalize()


def readme(people: int, synthetic: int, *, free_text: bool) -> str:
    """The page of a data set: who is in it, how to read it, what is left out, what to add."""
    who = f"{people} participant{'' if people == 1 else 's'}"
    simulated = f", {synthetic} of them synthetic: simulations, not people" if synthetic else ""
    return _README.format(people=who, synthetic=simulated, text=_LEFT_IN if free_text else _LEFT_OUT)
