"""A journal as it is published: what might say who someone is taken out, and a hash chain of its own. Pure.

Everything is hidden but what is known to say nothing of a person: numbers, words that a design or the program has, and
hashes. Dates are moved by whole runs of time: a participant's first run begins on the first day of 2000, and all that
lies between two moments of a participant stays as it was; each stretch of a monotonic clock begins at 0.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path

from analysis.archive.bids import OLDEST_AGE
from experiments.clock import utc_text
from experiments.config.door import read_toml
from experiments.config.setup import canonical_json, sha256
from experiments.config.toml_text import toml_text
from experiments.design.config import DesignConfig
from experiments.earlier_run import GAVE_WAY
from experiments.record.head_design import began_with
from experiments.record.journal import JournalError, contents_of, link_of, record_line
from experiments.record.lines import parsed_line
from experiments.record.rebuild import table
from experiments.session.states import EMERGENCY
from experiments.study import register
from experiments.study.study import Member

REDACTED = "[redacted]"
FIRST_MOMENT = datetime(2000, 1, 1, tzinfo=UTC)
"""When everybody's first run begins in an archive."""
FORMAT = 1

_SAFE = frozenset(
    [
        *(
            "n",
            "link",
            "kind",
            "setup",
            "laws",
            "plan",
            "participant",
            "gun",
            "clock",
            "experimenter_knows",
            "language",
            "provenance",
        ),
        *(
            "trial",
            "settings",
            "motion",
            "method",
            "question",
            "event",
            "state",
            "because",
            "flag",
            "by",
            "ended_by",
            "mark",
        ),
    ]
)
"""Keys whose values are words of the design, of the program or of the gun, or are written anew."""
_SAFE_WORDS = frozenset(["break-off", "pause", "correction", EMERGENCY, GAVE_WAY, "interrupted"])
"""Causes and reasons that the program gives."""
_WRITTEN = frozenset(["value", "text", "reason", "cut_reason", "set_aside_reason"])
"""Keys of what people wrote; all else that is no safe word, as a cause that names a port, is always hidden."""
_DATES = frozenset(["utc", "onset_utc", "stopped_utc"])
_HOST_S = frozenset(
    [
        *("monotonic_s", "synced_s", "shown_s", "requested_s", "pulse_start_s", "pulse_end_s", "home_predicted_s"),
        *("written_s", "acknowledged_s", "accepted_s"),
    ]
)
"""Seconds on the host's clock, which counts from when the computer was switched on."""
_GUN_US = frozenset(["gun_accepted_us", "gun_start_us", "gun_end_us"])
_FILES = frozenset(["gun", "synthetic", "file"])
"""Keys of a config that name files."""
_ELSEWHERE = re.compile(r"[\\/~]|[A-Za-z]:|\.\.[\\/]|.*[\\/]\.\.[\\/]")
"""How a path begins that leads out of the folder it is written in."""


def moment_of(text: str) -> datetime:
    """The moment of a journal's date and time. `ValueError`: it is none."""
    moment = datetime.fromisoformat(text)
    return moment if moment.tzinfo else moment.replace(tzinfo=UTC)


def redacted(path: Path, data: bytes, first: datetime, *, free_text: bool = False) -> bytes:
    """The bytes of a journal as they are published; what was cut off at its end is left out.

    `first`: when the participant's first run began. With `free_text` what people wrote stays. `JournalError` as for
    reading a journal, or if a date in it is none.
    """
    contents = contents_of(path, data)
    if contents is None:
        raise JournalError(f"{path}: line 1: no whole record")
    lines = data[: contents.whole_bytes].split(b"\n")[:-1]
    original = {
        f"{name}_line_sha256": hashlib.sha256(lines[at]).hexdigest() for name, at in (("first", 0), ("last", -1))
    }
    pen = _Pen(path=path, design=began_with(contents.head), first=first, free_text=free_text, original=original)
    for number, line in enumerate(lines, start=1):
        try:
            pen.write(parsed_line(line))
        except (ValueError, OverflowError) as error:
            raise JournalError(f"{path}: line {number}: {error}; the record was changed") from error
    return b"".join(pen.lines)


@dataclass(slots=True, kw_only=True)
class _Pen:
    """Writes a journal record by record; each stretch of it, from a beginning or a resumption, has clocks of its own.

    `original` has the hashes of the first and the last line of the journal that is redacted, `asked` the question that
    is open.
    """

    path: Path
    design: DesignConfig
    first: datetime
    free_text: bool
    original: Mapping[str, str]
    lines: list[bytes] = field(default_factory=list)
    asked: str = ""
    host_s: float = 0.0
    gun_us: int | None = None
    gun_count: int | None = None

    def write(self, value: Mapping[str, object]) -> None:
        """Add a record, with the link to the one before."""
        if value["kind"] in ("run", "resumed"):
            self.host_s, self.gun_us, self.gun_count = float(str(value["monotonic_s"])), None, None
        record = {key: self._part(key, one, self.asked) for key, one in value.items()}
        link = link_of(self.lines[-1]) if self.lines else ""
        self.lines.append(record_line(record | {"link": link} | self._of_kind(value)))

    def _of_kind(self, value: Mapping[str, object]) -> dict[str, object]:
        """What a record of its kind holds whole, or has that follows from the records before it."""
        match value["kind"]:
            case "run":
                return self._head(value)
            case "step":  # follows from plan and design
                body = value["body"]
                self.asked = str(body.get("question", "")) if isinstance(body, dict) else ""
                return {"body": body}
            case "finished":
                written = b"".join(self.lines)
                made = contents_of(self.path, written)
                of_table = hashlib.sha256(table(made)).hexdigest() if made else ""
                return {"table_sha256": of_table, "journal_sha256": hashlib.sha256(written).hexdigest()}
        return {}

    def _head(self, value: Mapping[str, object]) -> dict[str, object]:
        setup = without_places(value["setup"])
        laws = {"laws": without_places(value["laws"])} if "laws" in value else {}
        original = value.get("redacted_from", {"format": FORMAT, **self.original})
        return {"setup": setup, "setup_sha256": sha256(setup), **laws, "redacted_from": original}

    def _part(self, key: str, value: object, asked: str) -> object:
        """A value as it is published, by its key; `asked` is the question that it answers, if it does."""
        if key in _SAFE or key.endswith("sha256") or value is None or isinstance(value, bool):
            return value
        if isinstance(value, dict):
            about = str(value.get("question", asked))
            return {inner: self._part(inner, one, about) for inner, one in value.items()}
        if isinstance(value, list):
            return [self._part(key, one, asked) for one in value]
        return self._text(key, value, asked) if isinstance(value, str) else self._number(key, value)

    def _text(self, key: str, text: str, asked: str) -> str:
        if key in _DATES and text:
            return utc_text(FIRST_MOMENT + (moment_of(text) - self.first))
        if not text or text in _SAFE_WORDS:
            return text
        question = self.design.questions.get(asked)
        if key == "value" and question is not None and question.kind != "text":
            return text
        return text if self.free_text and key in _WRITTEN else REDACTED

    def _number(self, key: str, value: object) -> object:
        if key in _HOST_S and isinstance(value, int | float):
            return round(value - self.host_s, 9)
        if key in _GUN_US and isinstance(value, int):
            self.gun_us = value if self.gun_us is None else self.gun_us
            return value - self.gun_us
        if key == "gun_count" and isinstance(value, int):
            self.gun_count = value if self.gun_count is None else self.gun_count
            return value - self.gun_count + 1
        return value


def redacted_register(members: Iterable[Member]) -> bytes:
    """A register of who is in an archive, with what they said: ages end at 89, and everybody joined at once."""
    written, link = list[bytes](), ""
    for number, member in enumerate(one for one in members if one.facts is not None):
        facts = member.facts.model_dump(mode="json", exclude_none=True) if member.facts else {}
        if "age_years" in facts:
            facts["age_years"] = min(facts["age_years"], OLDEST_AGE)
        joined = register.entry("joined", member.participant_id, facts=facts).model_dump(mode="json")
        line = canonical_json({"n": number, "link": link, "utc": utc_text(FIRST_MOMENT)} | joined) + b"\n"
        written.append(line)
        link = link_of(line)
    return b"".join(written)


def redacted_config(path: Path) -> bytes:
    """A file of rules or requests as it is published: its values without comments, reasons of exclusions hidden."""
    values = read_toml(path)
    return toml_text({key: _without_reasons(one) for key, one in values.items()}).encode()


def _without_reasons(value: object) -> object:
    if isinstance(value, dict):
        return {key: REDACTED if key == "reason" else _without_reasons(one) for key, one in value.items()}
    return [_without_reasons(one) for one in value] if isinstance(value, list) else value


def without_places(value: object, key: str = "") -> object:
    """A config whose files are named without the folders of the computer that they lay on."""
    if isinstance(value, dict):
        return {inner: without_places(one, inner) for inner, one in value.items()}
    if isinstance(value, list):
        return [without_places(one) for one in value]
    if key in _FILES and isinstance(value, str) and _ELSEWHERE.match(value):
        return re.split(r"[\\/]", value)[-1]
    return value
