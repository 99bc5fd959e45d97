"""Every reader of the house on files that nobody meant: real ones damaged at byte, line, token and value level.

A reader may read what it is given or say what is wrong with a declared error; anything else, and anything that takes
long, is a finding. `READERS` has them all; the inputs follow from the seed.
"""

from __future__ import annotations

import json
import re
import resource
import shutil
import time
import tomllib
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from random import Random
from typing import Any

from analysis.logs.column_map import ColumnMap
from analysis.logs.exclusion_rules import Rules, apply_rules
from analysis.logs.level_map import LevelMap
from analysis.logs.reading import read_logs
from analysis.paper.audit.run import PaperFile, audit
from analysis.summary.remarks_coding import WrittenRemark, code_remarks, load_codebook
from device.messages import RecoilError
from device.wire import records
from experiments.config.door import Model, StudyConfig, load
from experiments.config.setup import GunConfig, sha256
from experiments.config.toml_text import toml_text
from experiments.load import load_setup, shipped_folder
from experiments.record import journal
from experiments.record.rebuild import table
from experiments.study import register
from experiments.synthetic.laws import SyntheticAnswers
from tests.journals import forged, raw

CONFIGS = shipped_folder()
NAMES = (
    "designs", "guns", "studies", "people's laws", "column maps", "maps of levels", "codebooks", "papers",
    "rules", "mapped logs", "own trials", "own ratings", "logs of designs", "journals", "registers", "the wire",
)  # fmt: skip
"""Of all readers."""
Mutate = Callable[[bytes, Random], bytes]
NASTY = (
    "0", "-1", "1", "-0.0", "1e308", "1e400", "nan", "inf", "-inf", "9" * 30, "9" * 5_000, "0.1e-320", "1_000", "0x10",
    "true", "false", '""', '"a"', "''", '"' + "x" * 3_000 + '"', '"1e999999999"', '"1/0"', '"5,19"', '"99999999%"',
    "[]", "[1, 2]", "[[[[1]]]]", "{}", "{a = 1}", "1979-05-27", "07:32:00", '"(a+)+$"', '"a{99999}"', '"\\u0000"',
    '"../../etc"', '"=1+1"', "null", "1" * 400, "999999", "1000000", "1000001", "-5", "3.5", '"-3.5"', '"0"',
    '"< .001"',
)  # fmt: skip
TOKEN = re.compile(rb"\"[^\"\n]*\"|'[^'\n]*'|-?\d+(?:\.\d+)?|true|false|[A-Za-z_][\w-]*")
ODD_BYTES = (
    b"\x00", b"\xff", b"\xed\xa0\x80",
    b"\xef\xbb\xbf", b"\r", b"\n", b'"', b"'", b",", b";", b"[", b"{", b"=", b"\xe2\x80\xae",
)  # fmt: skip


def bytes_changed(data: bytes, random: Random) -> bytes:
    """Some bytes put in, taken out, changed or moved."""
    found = bytearray(data)
    for _ in range(random.choice((1, 1, 2, 8))):
        at = random.randrange(len(found) + 1)
        match random.randrange(6):
            case 0:
                found[at:at] = random.choice(ODD_BYTES)
            case 1:
                del found[at : at + random.choice((1, 2, 40))]
            case 2:
                found[at : at + 1] = random.randbytes(1)
            case 3:
                del found[at:]
            case 4:
                found[at:at] = found[at : at + random.choice((3, 60))] * random.choice((1, 2, 50))
            case _:
                found[at:at] = random.randbytes(random.choice((1, 5)))
    return bytes(found)


def lines_changed(data: bytes, random: Random) -> bytes:
    """A line doubled, lost, moved or put in the place of another."""
    lines = data.split(b"\n")
    for _ in range(random.choice((1, 1, 3))):
        one, other = random.randrange(len(lines)), random.randrange(len(lines))
        match random.randrange(4):
            case 0:
                lines.insert(one, lines[other])
            case 1:
                lines[one], lines[other] = lines[other], lines[one]
            case 2:
                lines[one] = lines[other]
            case _:
                lines[one:one] = [lines[other]] * random.choice((2, 30))
    return b"\n".join(lines)


def tokens_changed(data: bytes, random: Random) -> bytes:
    """Words and numbers in the place of others: of the file itself, or such as nobody means."""
    tokens = list(TOKEN.finditer(data))
    for found in sorted(
        random.sample(tokens, min(len(tokens), random.choice((1, 1, 2, 4)))), key=lambda one: -one.start()
    ):
        new = random.choice(tokens)[0] if random.random() < 0.4 else random.choice(NASTY).encode()
        data = data[: found.start()] + new + data[found.end() :]
    return data


NUMBERS = (
    "0",
    "1",
    "-1",
    "2",
    "3",
    "0.5",
    "1e-300",
    "1e308",
    "-0.0",
    "5000",
    "1000000",
    "999999999999",
    "0.1",
    "24.0",
    "1e9",
)
TEXTS = (
    "",
    "0",
    "1",
    "3.47",
    "0.001",
    "< .05",
    "100%",
    "1.00",
    "-2.5",
    "99999999.99",
    "1/3",
    "0.999999",
    "aa",
    "P01",
    "between",
    "grim",
)


def settings_changed(data: bytes, random: Random) -> bytes:
    """Values of a TOML file in the place of others of their kind, so that the rules behind the types are reached."""
    values = list(re.finditer(rb"(?<=[=\[,{ ])(?:\"[^\"\n]*\"|-?\d+(?:\.\d+)?)(?=[\s,\]}])", data))
    for found in sorted(
        random.sample(values, min(len(values), random.choice((1, 1, 2, 3)))), key=lambda one: -one.start()
    ):
        text = found[0].startswith(b'"')
        known = [one[0] for one in values if one[0].startswith(b'"') == text]
        new = [f'"{one}"'.encode() for one in TEXTS] if text else [one.encode() for one in NUMBERS]
        data = data[: found.start()] + random.choice(random.choice((known, new))) + data[found.end() :]
    return data


def cells_changed(data: bytes, random: Random) -> bytes:
    """Cells of a table in the place of others."""
    rows = [line.split(b",") for line in data.split(b"\n")]
    for _ in range(random.choice((1, 1, 2, 6))):
        row, source = random.choice(rows), random.choice(rows)
        new = random.choice(source) if random.random() < 0.5 else random.choice(NASTY).encode()
        column = random.randrange(len(row))
        row[column] = new
        if random.random() < 0.2:
            for one in rows[1:]:
                one[column : column + 1] = [new]
    return b"\n".join(b",".join(row) for row in rows)


def structure_changed(data: bytes, random: Random) -> bytes:
    """Values of a TOML file, its tables and lists too, in the place of values of any kind."""
    with suppress(ValueError, UnicodeError, RecursionError):  # no more TOML
        entries = [tomllib.loads(data.decode())]
        values_changed(entries, random)
        return toml_text(entries[0]).encode()
    return bytes_changed(data, random)


MUTATIONS: tuple[Mutate, ...] = (
    bytes_changed,
    lines_changed,
    tokens_changed,
    settings_changed,
    settings_changed,
    settings_changed,
    structure_changed,
    structure_changed,
)
OF_TABLES: tuple[Mutate, ...] = (bytes_changed, lines_changed, tokens_changed, cells_changed, cells_changed)


def _values(value: Any, place: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """The places of all values inside JSON."""
    yield place
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, inner in items:
        yield from _values(inner, (*place, key))


ODD_VALUES = (
    None, True, False, 0, -1, 1, 10**30, 1e308, -0.5, "", "x", "forward", "2026-01-01T00:00:00Z", [], {}, [1],
    {"kind": 1}, "\ud800", "9" * 3_000, 2**63, "../x",
)  # fmt: skip


def values_changed(entries: list[Any], random: Random) -> None:
    """Values of some records in the place of others, keys lost."""
    for _ in range(random.choice((1, 1, 2))):
        entry = random.choice(entries)
        if not entry:  # all of it was lost
            continue
        *path, last = random.choice([place for place in _values(entry) if place])
        for key in path:
            entry = entry[key]
        if random.random() < 0.2:
            entry.pop(last)
        else:
            entry[last] = random.choice(ODD_VALUES)


@dataclass(frozen=True, slots=True, kw_only=True)
class Reader:
    """What reads: from a place to write and an input; from which inputs the others are made, and how."""

    read: Callable[[Path, bytes], object]
    beginnings: tuple[bytes, ...]
    mutate: tuple[Mutate, ...] = MUTATIONS


def _file(name: str, read: Callable[[Path], object]) -> Callable[[Path, bytes], object]:
    def written(folder: Path, data: bytes) -> object:
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(data)
        return read(path)

    return written


def _shipped(*patterns: str) -> tuple[bytes, ...]:
    return tuple(path.read_bytes() for pattern in patterns for path in sorted(CONFIGS.glob(pattern)))


def _audited(path: Path) -> object:
    paper = load(PaperFile, path)
    return audit(paper) if paper.direction is None and paper.preference is None else None


def _claims(text: bytes) -> tuple[bytes, ...]:
    """Each claim of a paper's file as a file of its own."""
    return tuple(b"[[claims]]" + claim for claim in text.split(b"[[claims]]")[1:])


def _coded(path: Path) -> object:
    book = load_codebook(path)
    remark = WrittenRemark(participant="P01", method="vibration", text="It is a toy " * 9)
    with suppress(ValueError):  # codes given to somebody who is not there: `analyze` says so
        return code_remarks([remark], ["P01", "P02"], book)
    return None


def _journal(folder: Path, data: bytes) -> object:
    contents = journal.contents_of(folder / "journal.jsonl", data)
    return None if contents is None else table(contents)


def _rechained(data: bytes, random: Random) -> bytes:
    """Records with other values in a chain that is whole, hashes included."""
    with suppress(UnicodeEncodeError, TypeError, ValueError, AttributeError, IndexError):  # no more a chain of records
        entries = [json.loads(line) for line in data.splitlines()]
        values_changed(entries, random)
        hashes = {f"{part}_sha256": sha256(entries[0][part]) for part in ("plan", "setup") if part in entries[0]}
        return forged([entries[0] | hashes, *entries[1:]])
    return bytes_changed(data, random)


def _framed(data: bytes, random: Random) -> bytes:
    """Other words in a frame whose checksum is right."""
    with suppress(ValueError, RecoilError):  # more than a frame holds
        body = tokens_changed(data.rstrip(b"\n")[6:-9], random).decode("ascii")
        return records.encode(records.Frame(number=7, body=body), "gun")
    return bytes_changed(data, random)


def _said_on_the_wire(_: Path, data: bytes) -> object:
    for line in records.Splitter().feed(data):
        with suppress(RecoilError):
            records.decode(line or b"", "gun")
        body = (line or b"")[6:-9].decode("ascii", "replace")
        parsers = (records.Named.parse, records.Setting.parse, records.ShotRecord.parse, records.StatusRecord.parse)
        for parse in (*parsers, records.whole_number, records.refusal_in):
            with suppress(RecoilError):
                parse(body)
    return None


MAP = b"""experiment = "direction"
[participant]
column = "participant_id"
[columns]
method = "method"
direction = "direction"
response = "response"
response_time = "response_time_s"
[response_time]
unit = "s"
"""
RULES = (CONFIGS / "examples" / "rules.toml").read_bytes()
CODES = b"""[[codes]]
code = "toy"
label = "A toy"
words = ["toy", "children"]
pattern = "toy|child(ren)?"
participants = ["P01"]
[[codes]]
code = "stable"
label = "Stable"
method = "asymmetric-2"
pattern = "stab(le|ility)"
"""


_SETTING = records.Setting(
    method="asymmetric-1", way="FORW", kind="PULS", amount=24_000, length_us=10_000, rest_us=100_000
)
_SHOT = records.ShotRecord(
    count=3,
    mark=7,
    ending="DONE",
    accepted_us=100,
    start_us=200,
    end_us=10_200,
    home_predicted_us=90_000,
    setting=_SETTING,
)
_STATUS = records.StatusRecord(state="ARMED", count=3, clock_us=9, ready_us=10, coil_mC=25_000, fault=0)
_NAMED = records.Named(model="gun", serial="0001", wire=1, firmware="1.0.0")
WIRE = tuple(
    records.encode(records.Frame(number=7, body=body), "gun")
    for body in (_SETTING.text(), _SHOT.text(), _STATUS.text(), _NAMED.text(), "OK", "ERR 12 LIMIT", "TIME 123456")
)


_ENTRIES = (
    {"kind": "joined", "participant_id": "P01", "facts": {"age_years": 24, "sex": "female", "handedness": "right"}},
    {"kind": "joined", "participant_id": "P02", "facts": {}},
    {"kind": "excluded", "participant_id": "P01", "reason": "left-handed"},
    {"kind": "left", "participant_id": "P01", "reason": "moved away"},
    {"kind": "readmitted", "participant_id": "P01", "reason": "a slip"},
    {"kind": "set-aside", "participant_id": "P02", "experiment": "direction", "reason": "fire alarm"},
)
REGISTERS = (forged([{"utc": "2026-01-01T00:00:00Z"} | one for one in _ENTRIES]),)


def _written(path: Path, data: bytes) -> Path:
    path.write_bytes(data)
    return path


def _config(model: type[Model], *beginnings: bytes) -> Reader:
    return Reader(read=_file("some.toml", lambda path: load(model, path)), beginnings=beginnings)


def _logs(name: str, beginnings: tuple[bytes, ...], mapping: ColumnMap | None = None) -> Reader:
    return Reader(
        read=_file(name, lambda path: read_logs([path], mapping=mapping)), beginnings=beginnings, mutate=OF_TABLES
    )


def _left(runs: Path, pattern: str) -> tuple[bytes, ...]:
    return tuple(path.read_bytes() for path in sorted(runs.rglob(pattern)))


def _of_configs(place: Path) -> dict[str, Reader]:
    """The files that people write."""
    configs = Path(shutil.copytree(CONFIGS, place / "configs", dirs_exist_ok=True))
    claims = _claims(_shipped("examples/audit.toml")[0])
    return {
        "designs": Reader(
            read=lambda _, data: load_setup(_written(configs / "fuzzed.toml", data)),
            beginnings=_shipped(
                "*ion.toml",
                "grip.toml",
                "pairs.toml",
                "*ism.toml",
                "magnitude.toml",
                "threshold.toml",
                "staircase.toml",
            ),
        ),
        "guns": _config(GunConfig, *_shipped("gun*.toml")),
        "studies": _config(StudyConfig, *_shipped("study.toml")),
        "people's laws": _config(SyntheticAnswers, *_shipped("synthetic/*.toml")),
        "column maps": _config(ColumnMap, MAP, *_shipped("examples/columns.toml")),
        "maps of levels": _config(LevelMap, *_shipped("examples/levels.toml")),
        "codebooks": Reader(read=_file("codes.toml", _coded), beginnings=(CODES,)),
        "papers": Reader(read=_file("paper.toml", _audited), beginnings=(*claims, *_shipped("paper.toml"))),
    }


def _of_tables(runs: Path) -> dict[str, Reader]:
    """The tables of runs and of other programs, and the rules about them."""
    logs = read_logs([runs])
    trials, ratings = _left(runs, "*direction_trials.csv"), _left(runs, "*preference_ratings.csv")
    foreign = tuple(data.replace(b"participant_id,experiment", b"participant_id,what") for data in trials)
    own = "sub-P01/sub-P01_task-{}.csv"
    return {
        "rules": Reader(
            read=_file("rules.toml", lambda path: apply_rules(logs, load(Rules, path))), beginnings=(RULES,)
        ),
        "mapped logs": _logs("foreign.csv", foreign, load(ColumnMap, _written(runs.parent / "map.toml", MAP))),
        "own trials": _logs(own.format("direction_trials"), trials),
        "own ratings": _logs(own.format("preference_ratings"), ratings),
        "logs of designs": _of_a_design(runs),
    }


def _of_a_design(runs: Path) -> Reader:
    """The table of a design, beside the journal that says what its columns are."""
    source = min(runs.rglob("*grip_journal.jsonl"))
    kept, table_name = source.read_bytes(), source.name.replace("_journal.jsonl", "_trials.csv")

    def read(folder: Path, data: bytes) -> object:
        place = folder / "sub-P01"
        place.mkdir(exist_ok=True)
        _written(place / source.name, kept)
        _written(place / table_name, data)
        return read_logs([folder])

    return Reader(read=read, beginnings=_left(runs, "*grip_*.csv"), mutate=OF_TABLES)


def _of_records(runs: Path) -> dict[str, Reader]:
    """What programs write for programs: journals, registers, the line to the gun."""
    chained = (bytes_changed, lines_changed, _rechained, _rechained, _rechained)
    journals = tuple(forged(raw(path)) for path in sorted(runs.rglob("*_journal.jsonl")))
    registers = _file(register.REGISTER_FILE, lambda path: register.read_register(path.parent))
    return {
        "journals": Reader(read=_journal, beginnings=journals, mutate=chained),
        "registers": Reader(read=registers, beginnings=REGISTERS, mutate=chained),
        "the wire": Reader(read=_said_on_the_wire, beginnings=WIRE, mutate=(bytes_changed, tokens_changed, _framed)),
    }


def readers(runs: Path) -> dict[str, Reader]:
    """All readers, those of what a run leaves with some real runs to begin from."""
    return _of_configs(runs.parent) | _of_tables(runs) | _of_records(runs)


MOST_S, MOST_MB = 5.0, 1_000


@dataclass(frozen=True, slots=True, kw_only=True)
class Finding:
    """An input that a reader did not take as it should."""

    reader: str
    number: int
    what: str
    data: bytes


def fuzzed(name: str, reader: Reader, folder: Path, inputs: range) -> Iterator[tuple[float, bool, Finding | None]]:
    """Of each input the processor's seconds, whether it was taken, and what is wrong if anything is."""
    for number in inputs:
        random = Random(f"{name} {number}")
        data = reader.beginnings[number % len(reader.beginnings)]
        for _ in range(random.choice((1, 1, 2))):
            data = random.choice(reader.mutate)(data, random)
        start = time.process_time()
        what, taken = "", True
        try:
            reader.read(folder, data)
        except RecoilError as error:
            taken = False
            what = "a message of more than 20,000 characters" if len(str(error)) > 20_000 else ""
        except Exception as error:  # noqa: BLE001 - this is what is looked for
            what = repr(error)
        seconds = time.process_time() - start
        if seconds > MOST_S:
            what = f"{what} {seconds:.1f} s"
        yield seconds, taken, Finding(reader=name, number=number, what=what, data=data) if what else None


def peak_MB() -> float:
    """The most memory that this process ever held."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
