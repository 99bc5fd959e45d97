"""`recoil new --from` and `recoil configs --schema`: a study of a shipped design, and what editors check files by."""

from __future__ import annotations

import json
import tomllib

import pytest
from jsonschema import Draft202012Validator

from experiments.config.door import ConfigError, EligibilityConfig
from experiments.load import load_setup, load_study, shipped_folder
from experiments.study.new_study import designs, new_study, shipped
from recoil.schemas import schemas


@pytest.mark.slow
@pytest.mark.parametrize("name", designs())
def test_a_study_of_a_shipped_design_is_for_everybody_and_knows_no_paper(name, tmp_path):
    folder = tmp_path / "study"
    made = new_study(folder, name)
    assert all(path.exists() for path in made)
    study, there = load_study(str(folder / "study.toml"))
    assert study.eligibility == EligibilityConfig()
    assert study.paper is None
    assert not (folder / "paper.toml").exists()
    assert [load_setup(str(there / one)).config.experiment for one in study.experiments] == [name]


def test_the_papers_study_has_all_that_its_designs_and_its_examples_name(tmp_path):
    made = new_study(tmp_path / "study")
    study, there = load_study(str(tmp_path / "study" / "study.toml"))
    assert (there / str(study.paper)).exists()
    loaded = [load_setup(str(there / one)) for one in (*study.experiments, "examples/hurry.toml")]
    assert [setup.config.experiment for setup in loaded] == ["direction", "preference", "direction"]
    assert all(setup.laws is not None for setup in loaded)
    for path in made:
        first = path.read_text().splitlines()[:1] if path.suffix == ".toml" else []
        if first and first[0].startswith("#:schema "):
            assert (path.parent / first[0].removeprefix("#:schema ")).exists()


@pytest.mark.parametrize("name", ["direction", "preference"])
def test_people_who_feel_the_gun_are_one_edit_away_in_the_papers_study(name, tmp_path):
    new_study(tmp_path / "study")
    design = tmp_path / "study" / f"{name}.toml"
    design.write_text(design.read_text().replace(f'"synthetic/{name}.toml"', f'"synthetic/{name}-felt.toml"', 1))
    assert load_setup(str(design)).config.synthetic == f"synthetic/{name}-felt.toml"


def test_with_the_paper_its_numbers_are_beside_it(tmp_path):
    new_study(tmp_path / "study", "direction", paper=True)
    assert load_study(str(tmp_path / "study" / "study.toml"))[0].paper == "paper.toml"


def test_a_design_that_is_not_shipped_is_refused_with_those_that_are(tmp_path):
    with pytest.raises(ConfigError, match="there are detection, direction"):
        new_study(tmp_path / "study", "nothing")
    assert not (tmp_path / "study").exists()


def test_the_shipped_schemas_are_those_of_the_models():
    there = {path.name: path.read_bytes() for path in (shipped_folder() / "schemas").glob("*.json")}
    assert there == schemas()


@pytest.mark.parametrize("path", [path for path in shipped() if path.suffix == ".toml"], ids=lambda path: path.stem)
def test_every_shipped_file_names_its_schema_and_keeps_it(path):
    first, *_ = path.read_text().splitlines()
    if path.stem == "audit":  # a paper's own, of which there is no one form
        return
    assert first.startswith("#:schema ")
    schema = (path.parent / first.removeprefix("#:schema ")).resolve()
    assert schema.parent == (shipped_folder() / "schemas").resolve()
    Draft202012Validator(json.loads(schema.read_text())).validate(tomllib.loads(path.read_text()))


def test_a_schema_finds_a_misspelt_key():
    table = tomllib.loads((shipped_folder() / "voltages.toml").read_text()) | {"tittle": "x"}
    found = [*Draft202012Validator(json.loads(schemas()["design.json"])).iter_errors(table)]
    assert any("tittle" in one.message for one in found)
