import json
import shutil
from dataclasses import FrozenInstanceError
from pathlib import Path

import pytest

from experiments.config.setup import canonical_json, sha256
from experiments.load import load_setup, shipped_folder


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for source in shipped_folder().glob("*.toml"):
        shutil.copy(source, tmp_path)
    return tmp_path


def edit(path: Path, old: str, new: str) -> None:
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new, 1), encoding="utf-8")


def test_the_same_files_elsewhere_have_the_same_hash(folder: Path) -> None:
    assert load_setup(str(folder / "direction.toml")).sha256() == load_setup("direction").sha256()


def test_comments_and_the_order_of_keys_do_not_matter(folder: Path) -> None:
    edit(folder / "direction.toml", "between_sets_s = 20.0\n", "")
    edit(
        folder / "direction.toml", "between_sessions_s = 300.0", "between_sessions_s = 300 # same\nbetween_sets_s = 20"
    )
    assert load_setup(str(folder / "direction.toml")).sha256() == load_setup("direction").sha256()


@pytest.mark.parametrize(
    ("file", "old", "new"),
    [
        ("direction.toml", "between_sets_s = 20.0", "between_sets_s = 20.5"),
        ("direction.toml", "Which way did", "Which way, please, did"),
        ("gun.toml", "voice_coil.friction_N = 1.12", "voice_coil.friction_N = 1.13"),
        ("gun.toml", 'damper = "on"', 'damper = "off"'),
    ],
)
def test_any_change_of_config_or_gun_changes_the_hash(folder: Path, file: str, old: str, new: str) -> None:
    edit(folder / file, old, new)
    assert load_setup(str(folder / "direction.toml")).sha256() != load_setup("direction").sha256()


def test_the_answers_of_a_table_are_part_of_the_setup(folder: Path) -> None:
    edit(folder / "preference.toml", 'observer = "ratings"', 'observer = "table"\ntable = "answers.csv"')
    hashes = set()
    for rating in ("1", "2"):
        (folder / "answers.csv").write_text(f"participant_id,method,rating\nP01,vibration,{rating}\n")
        setup = load_setup(str(folder / "preference.toml"))
        assert setup.record()["answers"] == [{"participant_id": "P01", "method": "vibration", "rating": rating}]
        hashes.add(setup.sha256())
    assert len(hashes) == 2


@pytest.mark.parametrize("name", ["direction", "preference"])
def test_a_setup_is_plain_json_and_its_hash_is_of_that(name: str) -> None:
    setup = load_setup(name)
    read_back = json.loads(canonical_json(setup.record()))
    assert setup.sha256() == sha256(read_back)


def test_a_setup_is_never_changed() -> None:
    setup = load_setup("direction")
    with pytest.raises(FrozenInstanceError):
        setup.answers = ()
