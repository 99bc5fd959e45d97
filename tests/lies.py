"""The table of lies: how logs, journals, maps, rules, codebooks and papers can lie, and what is said of each.

Every lie is told about the same few real runs. As a page: `python -m tests.lies > docs/lies.md`.
"""

from __future__ import annotations

import csv
import io
import re
import shutil
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from analysis.logs.column_map import ColumnMap
from analysis.logs.exclusion_rules import Rules, apply_rules
from analysis.logs.exclusions import left_out_by_files
from analysis.logs.reading import Logs, read_logs
from analysis.paper.audit.run import audit_file
from analysis.summary.remarks_coding import load_codebook
from analysis.summary.summary import summarize
from device.messages import RecoilError
from experiments.clock import VirtualClock
from experiments.config.door import load
from experiments.load import load_setup
from experiments.record.rebuild import rebuild_table
from experiments.record.tables import FILE_SUFFIX
from experiments.run import run
from experiments.run_request import RunRequest
from experiments.screens.synthetic import synthetic_screen
from tests.journals import forged, raw

Rows = list[dict[str, str]]


@dataclass(frozen=True, slots=True, kw_only=True)
class Lie:
    """`what` lies, `how`, and a part of what is `said`; `tell` tells it about runs in a folder and hears the answer."""

    what: str
    how: str
    said: str
    tell: Callable[[Path], str]


def real_runs(folder: Path) -> Path:
    """Two people in the paper's experiments and in two designs of other kinds."""
    for name in ("direction", "preference", "grip", "pairs"):
        for seed, code in enumerate(("P01", "P02"), start=1):
            asked = RunRequest(setup=load_setup(name), participant_id=code, results=folder, seed=seed)
            run(asked, synthetic_screen, VirtualClock())
    return folder


def table(folder: Path, experiment: str, code: str = "P01") -> Path:
    return folder / f"sub-{code}" / f"sub-{code}_task-{experiment}_{FILE_SUFFIX.get(experiment, 'trials')}.csv"


def journal(folder: Path, experiment: str, code: str = "P01") -> Path:
    return folder / f"sub-{code}" / f"sub-{code}_task-{experiment}_journal.jsonl"


def said_of(logs: Logs) -> str:
    """What there is to say of logs before any statistic."""
    return "\n".join(map(str, (*logs.problems, *logs.remarks, *logs.notes, *logs.begun, *left_out_by_files(logs))))


def said_in_analysis(logs: Logs) -> str:
    """What the statistics add: who is left out by their answers, and warnings."""
    found = summarize(logs, trade=False)
    return "\n".join([said_of(logs), *map(str, found.excluded), *found.warnings])


def rows_of(path: Path) -> Rows:
    return list(csv.DictReader(io.StringIO(path.read_text(encoding="utf-8"), newline="")))


def written(rows: Rows) -> bytes:
    text = io.StringIO(newline="")
    writer = csv.DictWriter(text, rows[0], lineterminator="\r\n")
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue().encode()


def in_table(
    experiment: str, change: Callable[[Rows], object], say: Callable[[Logs], str] = said_of
) -> Callable[[Path], str]:
    """A log without its journal whose rows were changed; of a design, beside a journal that is not finished."""

    def tell(folder: Path) -> str:
        path = table(folder, experiment)
        rows = rows_of(path)
        change(rows)
        path.write_bytes(written(rows))
        if experiment in FILE_SUFFIX:
            for one in folder.rglob("*_journal.jsonl"):
                one.unlink()
        return say(read_logs([path]))

    return tell


def put(row: int, **cells: str) -> Callable[[Rows], object]:
    return lambda rows: rows[row].update(cells)


def everywhere(**cells: str) -> Callable[[Rows], object]:
    return lambda rows: [row.update(cells) for row in rows]


def swapped(one: int, other: int) -> Callable[[Rows], object]:
    def change(rows: Rows) -> None:
        rows[one], rows[other] = rows[other], rows[one]

    return change


def turned(rows: Rows) -> None:
    """Answers turned round, with what says that they are right left as it was."""
    for row in rows:
        row["response"] = {"forward": "backward", "backward": "forward"}[row["response"]]


def in_bytes(experiment: str, change: Callable[[bytes], bytes]) -> Callable[[Path], str]:
    def tell(folder: Path) -> str:
        path = table(folder, experiment)
        path.write_bytes(change(path.read_bytes()))
        journal(folder, experiment).unlink()
        return said_of(read_logs([path]))

    return tell


def in_folder(change: Callable[[Path], object]) -> Callable[[Path], str]:
    """A whole folder in which something was changed."""

    def tell(folder: Path) -> str:
        change(folder)
        return said_of(read_logs([folder]))

    return tell


def lines(path: Path, change: Callable[[list[bytes]], object]) -> None:
    found = path.read_bytes().splitlines(keepends=True)
    change(found)
    path.write_bytes(b"".join(found))


def in_journal(
    experiment: str, change: Callable[[list[bytes]], object], *, alone: bool = False
) -> Callable[[Path], str]:
    """A journal whose lines were changed; `alone`: its table is gone."""

    def tell(folder: Path) -> str:
        lines(journal(folder, experiment), change)
        if alone:
            table(folder, experiment).unlink()
        return said_of(read_logs([folder]))

    return tell


def forged_journal(change: Callable[[list[dict[str, Any]]], object]) -> Callable[[Path], str]:
    """A journal whose records were changed with numbers and links made right, without a table; rebuilt and read."""

    def tell(folder: Path) -> str:
        path = journal(folder, "preference")
        records = raw(path)
        change(records)
        path.write_bytes(forged(records))
        table(folder, "preference").unlink()
        try:
            rebuild_table(path)
        except RecoilError as error:
            return f"{error}\n{said_of(read_logs([folder]))}"
        return "it was rebuilt"

    return tell


def replaced(number: int, old: bytes, new: bytes) -> Callable[[list[bytes]], object]:
    def change(found: list[bytes]) -> None:
        assert old in found[number]
        found[number] = found[number].replace(old, new, 1)

    return change


def answer_of(records: list[dict[str, Any]]) -> dict[str, Any]:
    """The body of the first rating."""
    found: dict[str, Any] = next(
        record["body"]
        for record in records
        if record["kind"] == "outcome" and isinstance(record["body"].get("value"), float)
    )
    return found


def step_of(records: list[dict[str, Any]]) -> dict[str, Any]:
    found: dict[str, Any] = next(record["body"] for record in records if record["kind"] == "step")
    return found


def edit(old: str, new: str) -> Callable[[Path], object]:
    def change(folder: Path) -> None:
        path = table(folder, "direction")
        path.write_text(path.read_text(encoding="utf-8").replace(old, new, 1), encoding="utf-8", newline="")

    return change


def of_another_study(folder: Path) -> None:
    """The table of another run, with the same code, beside this one's journal."""
    path = table(folder, "direction")
    path.write_bytes(re.sub(rb"\d{4}(?=-\d\d-\d\dT)", b"2019", path.read_bytes()))


def renamed(folder: Path) -> None:
    path = journal(folder, "direction", "P07")
    path.parent.mkdir()
    journal(folder, "direction").rename(path)


def copied_log(folder: Path) -> None:
    rows = [row | {"participant_id": "A01"} for row in rows_of(table(folder, "direction"))]
    table(folder, "direction", "A01").parent.mkdir()
    table(folder, "direction", "A01").write_bytes(written(rows))


def copied_journal(folder: Path) -> None:
    shutil.copy(journal(folder, "direction", "P02"), journal(folder, "direction"))


def rebuilt(change: Callable[[Path], object]) -> Callable[[Path], str]:
    """What `recoil rebuild` says after a change in a folder, whose table it leaves as it was."""

    def tell(folder: Path) -> str:
        change(folder)
        before = table(folder, "direction").read_bytes()
        try:
            rebuild_table(journal(folder, "direction"))
        except RecoilError as error:
            assert table(folder, "direction").read_bytes() == before
            return str(error)
        return "it was rebuilt"

    return tell


def unfinished_and_edited(folder: Path) -> None:
    lines(journal(folder, "direction"), lambda found: found.pop())
    turn = rows_of(table(folder, "direction"))
    turn[0].update(response=turn[0]["direction"], correct="1", response_time_s="0.7654321")
    table(folder, "direction").write_bytes(written(turn))


MAP = """
experiment = "direction"
[participant]
column = "who"
[columns]
method = "how"
direction = "way"
response = "said"
response_time = "rt"
correct = "ok"
onset_utc = "when"
[response_time]
unit = "s"
"""
PATTERN_MAP = MAP.replace('column = "who"', 'column = "who"\npattern = "(A[0-9])"')
UNTIMED_MAP = MAP.replace('response_time = "rt"', "").replace('correct = "ok"', "")
RATING_MAP = """
experiment = "preference"
[participant]
column = "who"
[columns]
method = "how"
rating = "mark"
[rating]
scale_min = 1
scale_max = 7
grain = 1
"""
FOREIGN = [
    {"who": who, "how": how, "way": way, "said": way, "rt": f"0.{seed}{at}1", "ok": "1", "when": ""}
    for seed, who in enumerate(("A1", "A2"), start=4)
    for how in ("soft", "hard")
    for at, way in enumerate(("forward", "backward") * 4)
]
MARKS = [
    {"who": who, "how": how, "mark": mark}
    for who in ("A1", "A2")
    for how, mark in (("soft", "2"), ("hard", "5"))
]  # fmt: skip


def mapped(
    change: Callable[[Rows], object], *, text: str = MAP, say: Callable[[Logs], str] = said_of
) -> Callable[[Path], str]:
    """A file of another program, and a map for it."""

    def tell(folder: Path) -> str:
        rows = [dict(row) for row in (MARKS if "preference" in text else FOREIGN)]
        change(rows)
        (folder / "a.csv").write_bytes(written(rows))
        (folder / "map.toml").write_text(text, encoding="utf-8")
        try:
            return say(read_logs([folder / "a.csv"], mapping=load(ColumnMap, folder / "map.toml")))
        except RecoilError as error:
            return str(error)

    return tell


def said_of_people(logs: Logs) -> str:
    """What is said where both people of a file are read all the same."""
    assert sorted(logs.trials["participant_id"].unique()) == ["A1", "A2"]
    return said_of(logs)


def said_of_strays(logs: Logs) -> str:
    """What is said of whoever is left out, where A1 is not."""
    found = summarize(logs, trade=False)
    assert found.direction is not None
    assert tuple(found.direction.participants.codes) == ("A1",)
    return "\n".join(f"{one.participant}: {one.reason} (rule: {one.rule}); {one.remedy}" for one in found.excluded)


def other_way(way: str) -> str:
    return {"forward": "backward", "backward": "forward"}[way]


def unsure(who: str) -> Callable[[Rows], Rows]:
    """Rows of somebody who is right in some of 64 trials, the same whoever it is."""
    return lambda rows: [
        rows[n % 16] | {"who": who, "said": rows[n % 16]["way"] if right == "1" else other_way(rows[n % 16]["way"])}
        for n, right in enumerate(f"{0x9E3779B97F4A7C15:064b}")
    ]


def copied(change: Callable[[Rows], object]) -> Callable[[Rows], object]:
    """What is copied of rows whose times are as irregular as people's are."""

    def told(rows: Rows) -> None:
        for n, row in enumerate(rows):
            row["rt"] = f"{0.3 + (37 * n**3 + 11 * n) % 613 / 1000:.3f}"
        change(rows)

    return told


def dated(hour: str) -> Callable[[Rows], object]:
    """Onsets within an hour, 12 s after each full minute."""
    return lambda rows: [row.update(when=f"{hour}:{n:02d}:12Z") for n, row in enumerate(rows)]


def nothing(_: object) -> None:
    """The file is as it should be: the map lies."""


def ruled(text: str) -> Callable[[Path], str]:
    def tell(folder: Path) -> str:
        (folder / "rules.toml").write_text(text, encoding="utf-8")
        try:
            effect = apply_rules(read_logs([folder]), load(Rules, folder / "rules.toml"))
        except RecoilError as error:
            return str(error)
        return "\n".join(map(str, (*effect.warnings, *effect.excluded)))

    return tell


def coded(text: str) -> Callable[[Path], str]:
    def tell(folder: Path) -> str:
        (folder / "codes.toml").write_text(text, encoding="utf-8")
        try:
            load_codebook(folder / "codes.toml")
        except RecoilError as error:
            return str(error)
        return "it was taken"

    return tell


def printed(claim: str) -> Callable[[Path], str]:
    """A paper with one claim."""

    def tell(folder: Path) -> str:
        head = '[paper]\ntitle = "T"\nsource = "s"\nfield = "f"\n\n[[claims]]\nplace = "p"\nquote = "q"\n'
        (folder / "paper.toml").write_text(head + claim, encoding="utf-8")
        try:
            return audit_file(str(folder / "paper.toml")).as_text()
        except RecoilError as error:
            return str(error)

    return tell


def no_journal(name: str, content: bytes) -> Callable[[Path], str]:
    def tell(folder: Path) -> str:
        (folder / name).write_bytes(content)
        try:
            rebuild_table(folder / name)
        except RecoilError as error:
            return str(error)
        return "it was rebuilt"

    return tell


_Told = tuple[str, Callable[[Path], str], str]
_TRIALS: tuple[_Told, ...] = (
    (
        "a time below 0",
        in_table("direction", put(3, response_time_s="-1")),
        "response_time_s -1 is out of range (rule: 0",
    ),
    ("a time of 10^300 s", in_table("direction", put(3, response_time_s="1e300")), "1e300 is out of range"),
    ("milliseconds for seconds", in_table("direction", put(3, response_time_s="750000")), "750000 is out of range"),
    ("a time that is no number", in_table("direction", put(3, response_time_s="nan")), "'nan' is not a finite number"),
    (
        "a decimal comma",
        in_table("direction", put(3, response_time_s="0,7")),
        "is not a finite number with a decimal point",
    ),
    ("all times alike", in_table("direction", everywhere(response_time_s="0.5")), "all 60 response times are 0.5 s"),
    (
        "times that nobody reacts in",
        in_table(
            "direction",
            lambda rows: [row.update(response_time_s=f"0.0{n + 10}") for n, row in enumerate(rows)],
            said_in_analysis,
        ),
        "60 anticipations, answers within 0.1 s of the onset",
    ),
    ("a negative count of attempts", in_table("direction", put(3, attempts="-3")), "attempts -3 is out of range"),
    ("no attempt, and yet a row", in_table("direction", put(3, attempts="0")), "attempts 0 is out of range (rule: 1"),
    ("half an attempt", in_table("direction", put(3, attempts="1.5")), "'1.5' is not a whole number"),
    ("a negative set", in_table("direction", put(3, set="-7")), "set -7 is out of range (rule: at least 1)"),
    (
        "a set that is left out",
        in_table("direction", put(3, set="3")),
        "set 3 at trial 4 of session 1 (rule: sets 1, 2",
    ),
    ("session 0", in_table("direction", put(3, session="0")), "session 0 is out of range (rule: at least 1)"),
    (
        "a session that is left out",
        in_table("direction", lambda rows: [row.update(session="4") for row in rows if row["session"] == "3"]),
        "session 3 is missing",
    ),
    (
        "two rows swapped",
        in_table("direction", swapped(3, 4)),
        "stands behind a later one (rule: rows in the order of the",
    ),
    ("rows swapped between sessions", in_table("direction", swapped(19, 20)), "trial 20 of session 1 stands behind"),
    (
        "a row twice",
        in_table("direction", lambda rows: rows.insert(4, dict(rows[3]))),
        "trial 4 stands twice in session 1",
    ),
    ("a row cut out", in_table("direction", lambda rows: rows.pop(4)), "trial 5 is missing in session 1"),
    (
        "an onset that is no date",
        in_table("direction", put(3, onset_utc="yesterday")),
        "'yesterday' is no date and time",
    ),
    ("the 30th of February", in_table("direction", put(3, onset_utc="2026-02-30T09:00:00Z")), "is no date and time"),
    (
        "dates that run backwards",
        in_table("direction", put(3, onset_utc="2001-01-01T00:00:00Z")),
        "is earlier than the onset before it (rule: later, unless the flag clock-set-back",
    ),
    ("right though it was wrong", in_table("direction", turned), "(rule: 1 if they are the same, else 0)"),
    ("an answer without a verdict", in_table("direction", put(3, correct="")), "(rule: both or neither are given)"),
    (
        "an answer that there is not",
        in_table("direction", put(3, response="left")),
        "'left' is not allowed (rule: one of",
    ),
    ("a method changed on the way", in_table("direction", put(3, method="ramp")), "(rule: one method a session)"),
    ("somebody else's row", in_table("direction", put(3, participant_id="P09")), "(rule: one participant a file)"),
    (
        "somebody else's file",
        in_table("direction", everywhere(participant_id="P09")),
        "but the file is named sub-P01 (rule: one participant a file, the one in its name)",
    ),
    ("another experiment's row", in_table("direction", put(3, experiment="preference")), "'preference' is not allowed"),
    (
        "an unanswered trial",
        in_table("direction", put(3, response="", correct=""), said_in_analysis),
        "`drop_unanswered = true` under [trials]",
    ),
    ("an experimenter as nobody", in_table("direction", put(3, response_source="ghost")), "'ghost' is not allowed"),
)
_RATINGS: tuple[_Told, ...] = (
    (
        "a rating beyond the scale",
        in_table("preference", put(1, rating="10.1")),
        "rating 10.1 is out of range (rule: 0 to 10)",
    ),
    (
        "a rating beyond by a hair",
        in_table("preference", put(1, rating="10.0000001")),
        "rating 10.0000001 is out of range",
    ),
    ("a rating below 0", in_table("preference", put(1, rating="-0.5")), "rating -0.5 is out of range"),
    ("a negative count of shots", in_table("preference", put(1, shots="-2")), "shots -2 is out of range"),
    ("a negative exposure", in_table("preference", put(1, exposure_s="-9")), "exposure_s -9 is out of range"),
    ("an exposure of a month", in_table("preference", put(1, exposure_s="2678400")), "2678400 is out of range"),
    (
        "a rating once more",
        in_table("preference", lambda rows: rows.append(rows[0] | {"trial": "4", "onset_utc": ""}), said_in_analysis),
        "rated more than once, so that the mean counts: P01",
    ),
    ("a rating removed", in_table("preference", put(1, rating=""), said_in_analysis), "1 of 3 ratings missing"),
    ("ratings swapped", in_table("preference", swapped(0, 1)), "stands behind a later one"),
    ("trial 7 of three", in_table("preference", put(2, trial="7")), "trial 3 is missing in the run"),
)
_BYTES: tuple[_Told, ...] = (
    ("an empty file", in_bytes("direction", lambda _: b""), "is empty"),
    ("a header alone", in_bytes("direction", lambda data: data.split(b"\n")[0] + b"\n"), "has a header but no rows"),
    ("a file cut off", in_bytes("direction", lambda data: data[:-20]), "the last line has no end"),
    (
        "bytes that are no text",
        in_bytes("direction", lambda data: data.replace(b"forward", b"\xff", 1)),
        "is not UTF-8",
    ),
    (
        "a column renamed",
        in_bytes("direction", lambda data: data.replace(b"response,", b"said,", 1)),
        "'response' is missing",
    ),
    (
        "a column twice",
        in_bytes("direction", lambda data: data.replace(b"note", b"flags", 1)),
        "stands 2 times in the header",
    ),
    ("a field too many", in_bytes("direction", lambda data: data.replace(b"\r\n", b",\r\n", 2)), "fields (rule: "),
    ("a spreadsheet's semicolons", in_bytes("direction", lambda data: data.replace(b",", b";")), "not comma-separated"),
)
_DESIGNS: tuple[_Told, ...] = (
    (
        "a rating off the grain",
        in_table("grip", put(1, realism="2.5")),
        "realism 2.5 is off the scale's grain (rule: 1 to",
    ),
    ("a rating beyond the scale", in_table("grip", put(1, realism="99")), "realism 99 is out of range"),
    ("rows swapped", in_table("grip", swapped(1, 2)), "is not what was planned for this row"),
    ("a level that was not planned", in_table("grip", put(1, grip="third hand")), "'third hand' is not allowed"),
    ("a row too few", in_table("grip", lambda rows: rows.pop()), "8 rows (rule: one for each of the 9 planned trials)"),
    ("a date that is none", in_table("grip", put(1, onset_utc="soon")), "'soon' is no date and time"),
    (
        "dates that run backwards",
        in_table("grip", put(4, onset_utc="2001-01-01T00:00:00Z")),
        "is earlier than the onset",
    ),
    ("times alike", in_table("pairs", everywhere(rather_time_s="0.5")), "all 20 response times are 0.5 s"),
    ("a time below 0", in_table("pairs", put(1, rather_time_s="-1")), "rather_time_s -1 is out of range"),
    ("an answer that there is not", in_table("pairs", put(1, rather="third")), "'third' is not allowed"),
    ("an answer changed", in_table("pairs", lambda rows: rows[1].update(rather_time_s="0.7")), "edited since the run"),
    (
        "its journal gone",
        in_folder(lambda folder: journal(folder, "grip").unlink()),
        "there is no sub-P01_task-grip_journal.jsonl beside it",
    ),
)
_JOURNALS: tuple[_Told, ...] = (
    (
        "the whole folder again, as a backup",
        in_folder(lambda folder: shutil.copytree(folder, folder / "the-backup")),
        "holds what sub-P01/sub-P01_task-preference_ratings.csv holds, byte for byte (rule: a run counts once)",
    ),
    (
        "a log copied under another code",
        in_folder(copied_log),
        "holds what the log of participant P01 in sub-P01/sub-P01_task-direction_trials.csv holds: all that was",
    ),
    ("a table edited after its run", in_folder(edit(",1,", ",2,")), "edited since the run; `recoil rebuild"),
    (
        "a table of another study, of the same code",
        in_folder(of_another_study),
        "is of another run of P01, as of another study: no onset is the same",
    ),
    (
        "the journal's last line deleted, and the table edited",
        in_folder(unfinished_and_edited),
        "is not what its journal says: edited, or the run went on since",
    ),
    (
        "the journal gone while others have one",
        in_folder(lambda folder: journal(folder, "direction").unlink()),
        "logs have no journal beside them, as the others have, so nothing proves them: P01",
    ),
    (
        "all journals gone while the tables stand",
        in_folder(lambda folder: [one.unlink() for one in folder.rglob("*_journal.jsonl")]),
        "none of the 4 logs has a journal beside it, which every run writes, so nothing proves what is there",
    ),
    (
        "a journal copied over another's",
        in_folder(copied_journal),
        "is of participant P02, experiment direction; was it",
    ),
    (
        "a journal copied over another's, to be rebuilt",
        rebuilt(copied_journal),
        "(rule: a journal is called as its run, sub-P02_task-direction_journal.jsonl); put it back there, and the",
    ),
    (
        "the table of a finished run gone",
        in_folder(lambda folder: table(folder, "direction").unlink()),
        "was made again",
    ),
    ("the table of a design gone", in_folder(lambda folder: table(folder, "grip").unlink()), "was made again"),
    (
        "a word changed in the middle",
        in_journal("direction", replaced(20, b'"kind":', b'"kind": ')),
        "does not follow from line 21, which was changed after it was written",
    ),
    ("a line cut out of the middle", in_journal("direction", lambda found: found.pop(50)), "a line was lost or added"),
    ("a line twice", in_journal("direction", lambda found: found.insert(50, found[49])), "a line was lost or added"),
    (
        "cut off in the middle",
        in_journal("direction", lambda found: found.__delitem__(slice(90, None))),
        "holds more than its journal, which is cut short",
    ),
    (
        "cut off, and the table gone",
        in_journal("direction", lambda found: found.__delitem__(slice(90, None)), alone=True),
        "participant P01 has begun direction and not finished it (",
    ),
    (
        "another line's place in the last record",
        in_journal("direction", replaced(-1, b'"journal_sha256":"', b'"journal_sha256":"0')),
        "its journal was changed and says the same as before",
    ),
    (
        "half a character in the head",
        in_journal("direction", replaced(0, b'"kind":"run"', b'"kind":"run","x":"\xed\xa0\x80"'), alone=True),
        "the journal is no help: line 1: not a JSON record",
    ),
    (
        "half a character, escaped",
        in_journal("direction", replaced(0, b'"kind":"run"', b'"kind":"run","x":"\\ud800"'), alone=True),
        "the journal is no help: line 1: not a JSON record",
    ),
    (
        "NaN in the plan",
        in_journal("direction", replaced(0, b'"seed":1', b'"seed":NaN'), alone=True),
        "NaN is no number of JSON",
    ),
    (
        "another plan under the same hash",
        in_journal("direction", replaced(0, b'"seed":1', b'"seed":2'), alone=True),
        "plan does not have the hash plan_sha256; it was changed",
    ),
    (
        "a journal under another name",
        in_folder(renamed),
        "is of participant P01, experiment direction; was it renamed?",
    ),
    (
        "a record of a trial that nobody planned",
        forged_journal(lambda records: step_of(records)["trial"].update(trial=99)),
        "trial 99 is none of the plan in line 1; the record was changed",
    ),
    (
        "a rating beyond the scale, with links made right",
        forged_journal(lambda records: answer_of(records).update(value=11.0)),
        "value 11.0 is no",
    ),
    (
        "an outcome without its step",
        forged_journal(lambda records: records.remove(next(one for one in records if one["kind"] == "step"))),
        "an outcome without its step; a line was lost",
    ),
    (
        "a step that is none",
        forged_journal(lambda records: step_of(records).update(kind="dance")),
        "the record was changed",
    ),
    ("no journal, but a gun", no_journal("gun.toml", b'title = "A gun"\n'), "gun.toml: is no journal"),
    ("no journal, but a table", no_journal("log.csv", b"participant_id,experiment\r\n"), "log.csv: is no journal"),
    ("no journal, but nothing", no_journal("null", b""), "null: is empty, or no text; it is no journal"),
    (
        "a participant's second log",
        in_folder(lambda folder: shutil.copy(table(folder, "direction"), folder / "sub-P01" / "copy_trials.csv")),
        "has a direction log already in",
    ),
)
_MAPS: tuple[_Told, ...] = (
    (
        "a rating doubled",
        mapped(lambda rows: rows.append(rows[0] | {"mark": "4"}), text=RATING_MAP),
        "is rated here and on line",
    ),
    (
        "every row twice",
        mapped(lambda rows: rows.extend(map(dict, rows[:])), text=RATING_MAP),
        "is rated here and on line",
    ),
    ("a rating off the grain", mapped(lambda rows: rows[0].update(mark="2.5"), text=RATING_MAP), "is off the grain"),
    (
        "a rating beyond the scale",
        mapped(lambda rows: rows[0].update(mark="8"), text=RATING_MAP),
        "rating 8 is out of range",
    ),
    (
        "milliseconds said to be seconds",
        mapped(lambda rows: [row.update(rt=str(350 + 7 * n)) for n, row in enumerate(rows)]),
        "response times is 402.5 s (rule: at most 60 s; are they ms? A map says so by response_time.unit)",
    ),
    (
        "a time beyond the next onset",
        mapped(lambda rows: (dated("2026-11-21T09")(rows), rows[3].update(rt="64"))),
        "a response time is 64 s after 2026-11-21T09:03:12Z, and the next onset 60 s after it (rule: an answer comes",
    ),
    (
        "onsets alike",
        mapped(lambda rows: [row.update(when="2026-11-21") for row in rows]),
        "all 16 onsets are 2026-11-21T00:00:00Z (rule: onsets that were measured differ",
    ),
    ("onsets of 1970", mapped(dated("1970-01-01T00")), "an onset is 1970-01-01T00:00:12Z (rule: from 2000 on"),
    ("onsets to come", mapped(dated("2226-11-21T09")), "an onset is 2226-11-21T09:00:12Z (rule: from 2000 on"),
    ("a time below 0", mapped(lambda rows: rows[0].update(rt="-0.2")), "participant A1 of "),
    ("a time of 10^300 s", mapped(lambda rows: rows[0].update(rt="1e300")), "1e300 is out of range"),
    ("times alike", mapped(lambda rows: [row.update(rt="0.5") for row in rows]), "all 16 response times are 0.5 s"),
    ("a date that is none", mapped(lambda rows: rows[0].update(when="noon")), "'noon' is no date and time"),
    (
        "right though it was wrong",
        mapped(lambda rows: rows[0].update(ok="0")),
        "correct is 0, but the direction is forward, the response forward",
    ),
    (
        "a verdict that is none",
        mapped(lambda rows: rows[0].update(ok="perhaps")),
        "'perhaps' is not allowed (rule: 1 or 0",
    ),
    (
        "a map that turns answers round",
        mapped(nothing, text=MAP + '[values.response]\nforward = "backward"\nbackward = "forward"\n'),
        "does the map turn one of them round?",
    ),
    (
        "a column that is not there",
        mapped(nothing, text=MAP.replace('"said"', '"answer"')),
        "column 'answer' is missing",
    ),
    (
        "an answer that the map does not know",
        mapped(lambda rows: rows[0].update(said="up")),
        "values.response says what",
    ),
    (
        "seconds for milliseconds",
        mapped(nothing, text=MAP.replace('unit = "s"', 'unit = "ms"'), say=said_in_analysis),
        "anticipations, answers",
    ),
    (
        "a method misspelt in one row",
        mapped(lambda rows: rows[20].update(how="sofd"), say=said_of_strays),
        "A2: trials with 'sofd' (1), which 1 of 2 people has (rule: a method is one that half of the people have)",
    ),
    (
        "every row thrice",
        mapped(copied(lambda rows: rows.extend(2 * [*map(dict, rows)]))),
        "is one part several times over",
    ),
    (
        "every row thrice, one after the other",
        mapped(copied(lambda rows: rows.__setitem__(slice(None), [dict(row) for row in rows for _ in range(3)]))),
        "is one part several times over, again from row 2 on: all that was asked and answered",
    ),
    (
        "somebody's rows under another's code",
        mapped(copied(lambda rows: rows.extend(row | {"who": "A3"} for row in rows[:16]))),
        "participant A3 of a.csv: holds what the log of participant A1 holds: all that was asked and answered, and the "
        "response times to the ms (rule: by chance that is so less than once in 1,000,000,000, and answers count once)",
    ),
    (
        "ten of somebody's rows in another's log",
        mapped(copied(lambda rows: rows.__setitem__(slice(18, 28), [row | {"who": "A2"} for row in rows[2:12]]))),
        "participant A2 of a.csv: rows 3 to 12 at least are rows 3 to 12 of participant A1: all that was asked and",
    ),
    (
        "somebody's answers without times under another's code",
        mapped(lambda rows: rows.extend([*unsure("A3")(rows), *unsure("A4")(rows)]), text=UNTIMED_MAP),
        "participant A4 of a.csv: holds what the log of participant A3 holds: all that was asked and answered (rule:",
    ),
    (
        "answers turned round",
        mapped(lambda rows: [row.update(said=other_way(row["way"])) for row in rows], text=UNTIMED_MAP),
        "each of 2 people is right in fewer than half of the trials, in 0 of 32 altogether",
    ),
    (
        "a participant's code that is empty",
        mapped(lambda rows: rows[3].update(who=""), say=said_of_people),
        "line 5, column who: the participant's code is empty (rule: every row says whose it is); this row is left out",
    ),
    (
        "a participant's code that does not fit",
        mapped(lambda rows: rows[3].update(who="?"), text=PATTERN_MAP, say=said_of_people),
        "[values.participant] names who does not fit); this row is left out, and the others used",
    ),
    (
        "answers that are the directions",
        mapped(nothing, text=MAP.replace('"said"', '"way"')),
        "columns.response and columns.direction are both the column 'way' (rule: what a participant did stands in a",
    ),
    (
        "a verdict that is the answer",
        mapped(nothing, text=MAP.replace('"ok"', '"said"')),
        "columns.response and columns.correct are both the column 'said'",
    ),
    ("no unit", mapped(nothing, text=MAP.replace('[response_time]\nunit = "s"', "")), "response_time.unit is missing"),
    ("an unknown key", mapped(nothing, text=MAP + "tempo = 3\n"), "unknown key"),
    ("a scale upside down", mapped(nothing, text=RATING_MAP.replace("= 7", "= 0")), "must be below scale_max"),
)
_RULES: tuple[_Told, ...] = (
    (
        "a participant who is not there",
        ruled('[[excluded]]\ncode = "P77"\nreason = "x"\n'),
        "exclude P77, who has no log here",
    ),
    (
        "a method that is not there",
        ruled('[[accuracy]]\nmethod = "ramp"\nmin_share = 0.5\n'),
        "ask for accuracy with ramp, which no log with right answers has",
    ),
    (
        "bounds the wrong way round",
        ruled("[trials]\nresponse_time_min_s = 2.0\nresponse_time_max_s = 1.0\n"),
        "must be below response_time_max_s = 1",
    ),
    ("a share of 80", ruled("[participants]\nmin_kept_share = 80\n"), "min_kept_share = 80: must be at most 1"),
    ("no reason", ruled('[[excluded]]\ncode = "P01"\n'), "reason: is missing; it is required"),
    (
        "rules that leave nobody",
        ruled("[trials]\nresponse_time_min_s = 60.0\n"),
        "0 of 60 trials kept (rule: at least one)",
    ),
)
_CODES: tuple[_Told, ...] = (
    ("a code twice", coded(2 * '[[codes]]\ncode = "a"\nlabel = "A"\nwords = ["x"]\n'), "stand there more than once"),
    (
        "a pattern that is none",
        coded('[[codes]]\ncode = "a"\nlabel = "A"\npattern = "("\n'),
        "is no regular expression",
    ),
    ("no code at all", coded("codes = []\n"), "holds too few; give at least 1"),
    ("a label that is empty", coded('[[codes]]\ncode = "a"\nlabel = ""\nwords = ["x"]\n'), "codes.0.label = ''"),
)
_PAPERS: tuple[_Told, ...] = (
    ("a mean that no data have", printed('kind = "grim"\nmean = "5.19"\nn = 28\n'), "not attainable"),
    ("a mean without quotes", printed('kind = "grim"\nmean = 5.19\nn = 28\n'), "claims.0.mean = 5.19"),
    ("an SD that no data have", printed('kind = "debit"\nmean = "0.35"\nsd = "0.18"\nn = 20\n'), "not attainable"),
    (
        "a percentage of other people",
        printed('kind = "percent"\npercent = "33.7%"\ncount = 5\nn = 14\n'),
        "not attainable",
    ),
    (
        "a sum that is another",
        printed('kind = "total"\nprinted = "601"\nterms = [{ times = [4, 25, 6] }]\n'),
        "not attainable",
    ),
    ("a check that there is not", printed('kind = "magic"\n'), "kind = 'magic'"),
    ("nobody at all", printed('kind = "grim"\nmean = "5.19"\nn = 0\n'), "claims.0.n = 0"),
)
_BY_KIND = {
    "table of trials": _TRIALS,
    "table of ratings": _RATINGS,
    "file": _BYTES,
    "table of a design": _DESIGNS,
    "journal": _JOURNALS,
    "map, or a log that it reads": _MAPS,
    "rules": _RULES,
    "codebook": _CODES,
    "paper": _PAPERS,
}
LIES = tuple(
    Lie(what=what, how=how, said=said, tell=tell) for what, some in _BY_KIND.items() for how, tell, said in some
)

_HEAD = f"""# The table of lies

Made by `python -m tests.lies > docs/lies.md`; do not edit by hand.

Nothing that comes in is believed. Each of these {len(LIES)} lies is told to the program in `tests/test_lies.py`, about
real runs, and the words on the right are a part of what it says: on the terminal, in the report, or as the one message
of a command that refuses. Where a log cannot be used, it is left out with its place, value and rule, and the person is
counted among those who are left out; everybody else is analysed.

| what lies | how | what is said |
| --- | --- | --- |
"""


_TAIL = """
## What is taken for a copy

- A table of our own with onsets is a copy of another if both are the same byte for byte: the folder was copied.
- A table beside a redacted journal, as in an archive, is a copy where a journal is read whose last line it names.
- Rows of trials are copies of others if they are the same in all that was asked, in the answers and in the response
  times to the ms, and would be so by chance less than once in 10^9. A log says by itself how rare its rows are: each
  counts −ln(share of its answer among those to the same question) − ln(share of its time among its times), and the sum
  over the rows of one copy is above ln 10^9 = 20.7; where answers follow the answers or the question before, as in a
  person who presses the keys in turn, or times go on in equal steps, as made ones do, the shares are those of what
  followed. Stretches of ten rows with times
  are looked for wherever they stand. Without times whole logs are compared with each other, and a log with itself: is
  it one part twice, thrice, five or seven times over, or each of its rows? Logs that are so in the same way are judged
  by the sum of them all.
- Of two logs that are alike from end to end one stays, the one that a journal proves, else the first: the same answers
  count once. Where a part was copied, both are left out but for what a journal proves.

## Which times no log has

Half of the response times above 60 s; ten or more onsets that are all the same; onsets before the year 2000, or more
than 366 days ahead of the clock of the computer that analyses; a participant's own response time that is more than a
second longer than the time to the next onset (a minute, where onsets are given in whole minutes). A log that its
journal proves is used with a remark: its clock was wrong, not its answers.

## What cannot be known

- Answers that are turned round, where no column `correct` says what was right: a remark is made if nobody is right in
  half of the trials, and all together are so by guessing less than once in a thousand. People who are sometimes right
  and sometimes wrong look the same either way, as do answers that were copied from the column of directions.
- Copies of fewer than ten rows, of a part of a log without times, of people who are nearly always right and have no
  times, of logs that ask for no choice (ratings, numbers, rankings, words), and copies in which every time was changed
  by some ms.
- Whether the unit of response times is right where both readings are human: 1 to 60 are taken as they are.
- Tables without any journal: that is said, and they are read.
"""


def page() -> str:
    """The table as Markdown, and the rules that it does not show."""
    return _HEAD + "".join(f"| {lie.what} | {lie.how} | {_cell(lie.said)} |\n" for lie in LIES) + _TAIL


def _cell(text: str) -> str:
    return f"`` {text} ``" if "`" in text else f"`{text}`"


if __name__ == "__main__":
    sys.stdout.write(page())
