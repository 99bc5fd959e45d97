import json
import shutil
from dataclasses import FrozenInstanceError
from pathlib import Path

import pytest

from experiments.config.setup import canonical_json, sha256
from experiments.load import load_setup, shipped_folder
from experiments.synthetic.laws import SyntheticAnswers, TableLaw


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "synthetic").mkdir()
    for source in [*shipped_folder().glob("*.toml"), *shipped_folder().glob("synthetic/*.toml")]:
        shutil.copy(source, tmp_path / source.relative_to(shipped_folder()))
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


def test_who_answers_in_simulations_is_read_with_the_setup_and_no_part_of_its_hash(folder: Path) -> None:
    table = 'law = "table"\nfile = "answers.csv"\n'
    people = f'[questions.rating]\n{table}[questions.comment]\nlaw = "words"\n'
    (folder / "synthetic" / "preference.toml").write_text(people)
    for rating in ("1", "2"):
        (folder / "answers.csv").write_text(f"participant_id,method,rating\nP01,vibration,{rating}\n")
        setup = load_setup(str(folder / "preference.toml"))
        assert isinstance(setup.laws, SyntheticAnswers)
        law = setup.laws.questions["rating"]
        assert isinstance(law, TableLaw)
        assert law.rows == ({"participant_id": "P01", "method": "vibration", "rating": rating},)
        assert setup.sha256() == load_setup("preference").sha256()


@pytest.mark.parametrize("name", ["direction", "preference", "realism"])
def test_a_setup_is_plain_json_and_its_hash_is_of_that(name: str) -> None:
    setup = load_setup(name)
    read_back = json.loads(canonical_json(setup.record()))
    assert setup.sha256() == sha256(read_back)


@pytest.mark.parametrize("name", ["config", "gun", "source", "laws"])
def test_a_setup_is_never_changed(name: str) -> None:
    setup = load_setup("direction")
    with pytest.raises(FrozenInstanceError):
        setattr(setup, name, None)
