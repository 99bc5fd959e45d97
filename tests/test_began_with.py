"""`recoil configs --from JOURNAL --copy DIR`: the files that a run began with come back, to the very same hash."""

from __future__ import annotations

import json
import re
import shlex
from pathlib import Path
from typing import Any

import pytest

from experiments.clock import VirtualClock
from experiments.config.door import ConfigError
from experiments.config.setup import canonical_json, sha256
from experiments.load import load_setup, shipped_folder
from experiments.record.journal import JournalError, read_journal
from experiments.record.rebuild import rebuild
from experiments.run import run
from experiments.run_request import RunRequest
from experiments.screens.synthetic import synthetic_screen
from experiments.study.files_begun_with import copy_began_with
from experiments.study.folders import PlaceError
from tests.conftest import Recoil

pytestmark = pytest.mark.slow

ODD = 'A "quoted" \\ title, [in] {brackets} # no comment: 反冲 é ∞'


def configs(folder: Path) -> Path:
    """The shipped configs, as a laboratory would have them in a folder of its own."""
    (folder / "synthetic").mkdir(parents=True)
    for source in [*shipped_folder().glob("*.toml"), *shipped_folder().glob("synthetic/*.toml")]:
        (folder / source.relative_to(shipped_folder())).write_bytes(source.read_bytes())
    return folder


def edited(path: Path, *edits: tuple[str, str]) -> Path:
    text = path.read_text(encoding="utf-8")
    for old, new in edits:
        assert old in text, f"no {old!r} any more"
        text = text.replace(old, new, 1)
    path.write_text(text, encoding="utf-8")
    return path


def journal_of(config: Path, results: Path) -> Path:
    setup = load_setup(str(config))
    done = run(RunRequest(setup=setup, participant_id="P01", results=results, seed=1), synthetic_screen, VirtualClock())
    return done.place.journal


TABLE = '[questions.rating]\nlaw = "table"\nfile = "answers/mine.csv"\n[questions.comment]\nlaw = "words"\n'


def with_a_table(folder: Path) -> Path:
    rows = ["P01,vibration,2.5", '"P01","asymmetric-1","6.25"', "P01,asymmetric-2,10"]
    (folder / "answers").mkdir()
    (folder / "answers" / "mine.csv").write_text(
        "\n".join(["participant_id,method,rating", *rows]) + "\n", encoding="utf-8-sig"
    )
    (folder / "synthetic" / "preference.toml").write_text(TABLE)
    return folder / "preference.toml"


def one_up(folder: Path) -> Path:
    inner = folder / "examples"
    inner.mkdir()
    (inner / "hurry.toml").write_bytes((shipped_folder() / "examples" / "hurry.toml").read_bytes())
    return inner / "hurry.toml"


CASES: dict[str, Any] = {
    "direction as shipped": lambda folder: folder / "direction.toml",
    "preference as shipped": lambda folder: folder / "preference.toml",
    "what hands set": lambda folder: folder / "realism.toml",
    "people of two groups": lambda folder: folder / "grip.toml",
    "pairs, a gun of another name": lambda folder: folder / "pairs.toml",
    "a title that has all that is hard to write": lambda folder: (
        edited(
            folder / "gun.toml",
            ('label = "Vibration"', f"label = {json.dumps(ODD)}"),
            ('title = "Ungrounded', f"title = {json.dumps(ODD)} # "),
        ),
        edited(folder / "direction.toml", ('"Direction recognition of a shot"', json.dumps(ODD))),
    )[1],
    "words that are hard to write": lambda folder: (
        edited(
            folder / "synthetic" / "preference.toml",
            ('law = "words"', f'law = "words"\ntexts = ["", {json.dumps(ODD)}]'),
        ),
        folder / "preference.toml",
    )[1],
    "numbers that must come back exactly": lambda folder: (
        edited(folder / "synthetic" / "direction.toml", ("shift_s = 0.35", "shift_s = 0.30000000000000004")),
        edited(
            folder / "direction.toml",
            ("guard_s = 0.25", "guard_s = 0.30000000000000004"),
            ("hand_over_s = 15.8", "hand_over_s = 15"),
        ),
    )[1],
    "a gun with strips and whole numbers": lambda folder: (
        edited(
            folder / "gun.toml",
            ("voltage_V = 16.0", "voltage_V = 16"),
            (
                "voice_coil.friction_N = 1.12",
                "[methods.asymmetric-2.strips]\ncoefficient = 0.7\nstiffness_N_m = 1300.0\ndeformation_m = 5e-4",
            ),
        ),
        folder / "direction.toml",
    )[1],
    "a seed of its own": lambda folder: edited(
        folder / "direction.toml", ("[factors.method]", "seed = 7\n[factors.method]")
    ),
    "a table of answers in a folder below": with_a_table,
    "a gun in the folder above, instructions, who feels": one_up,
}


@pytest.mark.parametrize("case", CASES)
def test_the_files_that_a_run_began_with_load_to_the_same_setup(case: str, tmp_path: Path) -> None:
    config = CASES[case](configs(tmp_path / "lab"))
    journal = journal_of(config, tmp_path / "results")
    copied = copy_began_with(journal, tmp_path / "back")
    assert load_setup(str(copied[0])).record() == load_setup(str(config)).record()
    assert load_setup(str(copied[0])).laws == load_setup(str(config)).laws is not None
    assert load_setup(str(copied[0])).sha256() == read_journal(journal).head.setup_sha256
    assert all(path.is_relative_to(tmp_path / "back") for path in copied)


@pytest.mark.parametrize(
    ("file", "old", "new"),
    [
        ("direction.toml", "between_sets_s = 20.0", "between_sets_s = 25.0"),
        ("synthetic/direction.toml", "shift_s = 0.35", "shift_s = 0.45"),
    ],
)
def test_a_resume_that_was_refused_names_the_command_that_makes_it_possible(
    recoil: Recoil, tmp_path: Path, file: str, old: str, new: str
) -> None:
    lab = configs(tmp_path / "my lab")
    journal = journal_of(lab / "direction.toml", tmp_path / "results")
    whole = journal.read_bytes().splitlines(keepends=True)
    journal.write_bytes(b"".join(whole[:9]))
    edited(lab / file, (old, new))

    def resume(config: str) -> Any:
        options = ("--participant", "P01", "--screen", "synthetic", "--results", tmp_path / "results", "--resume")
        return recoil("run", config, *options)

    refused = resume("my lab/direction.toml")
    assert refused.returncode == 2
    command = re.search(r"`recoil (configs --from .* --copy) DIR`", refused.stderr)
    assert command is not None, refused.stderr
    given = recoil(*shlex.split(command[1]), "back")
    assert given.returncode == 0, given.stderr
    assert given.stdout.splitlines() == ["back/direction.toml", "back/gun.toml", "back/synthetic/direction.toml"]
    assert resume("back/direction.toml").returncode == 0
    assert read_journal(journal).finished


def test_nothing_is_overwritten_and_then_nothing_is_written(tmp_path: Path) -> None:
    journal = journal_of(configs(tmp_path / "lab") / "direction.toml", tmp_path / "results")
    (tmp_path / "back").mkdir()
    (tmp_path / "back" / "gun.toml").write_text("mine")
    with pytest.raises(PlaceError, match=r"gun\.toml: already there; nothing is overwritten"):
        copy_began_with(journal, tmp_path / "back")
    assert [path.name for path in (tmp_path / "back").iterdir()] == ["gun.toml"]
    assert (tmp_path / "back" / "gun.toml").read_text() == "mine"


def forged(journal: Path, **changes: Any) -> Path:
    """The journal with another setup, or other synthetic people, at its head, hashed as it should be."""
    head = json.loads(journal.read_bytes().splitlines()[0])
    for part, values in changes.items():
        table = head["laws"]["questions"] if part == "laws" else head["setup"][part]
        table |= values
        head["laws"]["assumed"] = []
    head["setup_sha256"] = sha256(head["setup"])
    journal.write_bytes(canonical_json(head) + b"\n")
    return journal


def naming(key: str, name: str) -> dict[str, Any]:
    """What names a file by a key: of the design, or of a law."""
    if key == "file":
        return {"laws": {"response": {"law": "table", "file": name, "by": ["method"], "rows": []}}}
    return {"experiment": {key: name}}


@pytest.mark.parametrize("key", ["gun", "synthetic", "file"])
@pytest.mark.parametrize(
    ("name", "error", "said"),
    [
        ("/etc/gun.toml", PlaceError, "no place inside a folder of copies"),
        ("gun\0.toml", (PlaceError, JournalError), "no place inside a folder of copies|not printed"),
        ("direction.toml", ConfigError, "does not load here"),
    ],
)
def test_a_file_that_cannot_lie_beside_its_config_is_refused(
    key: str, name: str, error: type[Exception] | tuple[type[Exception], ...], said: str, tmp_path: Path
) -> None:
    journal = journal_of(configs(tmp_path / "lab") / "direction.toml", tmp_path / "results")
    with pytest.raises(error, match=said):
        copy_began_with(forged(journal, **naming(key, name)), tmp_path / "back")
    assert not list(tmp_path.rglob("back/**/*.toml"))


@pytest.mark.parametrize("key", ["gun", "synthetic", "file"])
@pytest.mark.parametrize("name", ["../one.toml", "../../ones/one.toml", "ones/../../one.toml"])
def test_no_name_of_a_file_leads_out_of_the_folder_of_copies(key: str, name: str, tmp_path: Path) -> None:
    journal = journal_of(configs(tmp_path / "lab") / "direction.toml", tmp_path / "results")
    (tmp_path / "back").mkdir()
    before = {path for path in tmp_path.rglob("*") if not path.is_relative_to(tmp_path / "back")}
    try:
        copied = copy_began_with(forged(journal, **naming(key, name)), tmp_path / "back")
    except ConfigError:
        copied = []
    assert {path for path in tmp_path.rglob("*") if not path.is_relative_to(tmp_path / "back")} == before
    assert bool(copied) is not name.startswith("ones/")


def test_what_does_not_load_to_the_same_values_is_taken_away_again(tmp_path: Path) -> None:
    journal = journal_of(configs(tmp_path / "lab") / "direction.toml", tmp_path / "results")
    with pytest.raises(ConfigError, match=r"it: gun: serial.round_trip_limit_s \(0.02, now none\);"):
        copy_began_with(forged(journal, gun={"serial": {"round_trip_limit_s": 0.02}}), tmp_path / "back")
    assert not list(tmp_path.glob("back/**/*"))


@pytest.mark.parametrize(
    ("data", "said"),
    [
        (b"", "line 1: no whole record"),
        (b'{"kind": "run"', "line 1: no whole record"),
        (b'{"kind": "step", "n": 0, "link": ""}\n', "line 1: not the head of a journal"),
        (b"PK\x03\x04\n", "is no journal"),
    ],
)
def test_a_file_that_is_no_journal_is_refused(data: bytes, said: str, tmp_path: Path) -> None:
    (tmp_path / "some.jsonl").write_bytes(data)
    with pytest.raises(JournalError, match=said):
        copy_began_with(tmp_path / "some.jsonl", tmp_path / "back")


def test_a_journal_with_a_key_that_this_version_does_not_know_is_not_to_be_corrected(tmp_path: Path) -> None:
    path = journal_of(configs(tmp_path / "lab") / "preference.toml", tmp_path)
    said = r"sparkle = true: unknown key.*; but correct nothing in a journal.* another version of Recoil wrote it"
    with pytest.raises(JournalError, match=said):
        rebuild(forged(path, experiment={"sparkle": True}))


def test_from_goes_with_copy(recoil: Recoil) -> None:
    done = recoil("configs", "--from", "some_journal.jsonl")
    assert done.returncode == 2
    assert "--from goes with --copy DIR" in done.stderr
