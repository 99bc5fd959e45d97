"""Recoil is updated during a study: what an earlier version recorded without a new key is the same study and run."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path
from shutil import copytree
from typing import Any, NamedTuple

import pytest
from pydantic import BaseModel

from analysis.archive.archive_export import ArchiveRequest, export_archive
from analysis.archive.preregistration import freeze
from analysis.logs.reading import read_logs
from analysis.summary.deviations import AnalysisFiles, deviations
from device.simulated import SimulatedGun
from experiments.clock import RealClock, VirtualClock
from experiments.config.door import Model, StudyConfig, checked_table, read_toml
from experiments.config.setup import GunConfig, Setup, sha256
from experiments.design.config import DesignConfig
from experiments.design.plan import Plan
from experiments.earlier_run import NotAsItBegan, resumed_plan
from experiments.load import load_setup, load_study, shipped_folder
from experiments.record.journal import read_journal
from experiments.run import run
from experiments.run_request import Again, RunRequest
from experiments.screens.synthetic import synthetic_screen
from experiments.study.changes import KeyChange, changed_keys, setup_changes, setup_key
from experiments.study.files_begun_with import copy_began_with
from experiments.study.folders import freeze_status
from experiments.study.new_study import new_study
from experiments.study.preregistration import STUDY_FILE, Preregistration, changes, files_now, run_warnings
from experiments.synthetic.laws import SyntheticAnswers
from tests.adaptive_runs import adaptive
from tests.designs import SHIPPED, changed
from tests.journals import forged, raw

Record = dict[str, Any]
Place = tuple[str | int, ...]
MODELS: dict[str, type[BaseModel]] = {"experiment": DesignConfig, "gun": GunConfig}
FILES: dict[str, type[BaseModel]] = {
    STUDY_FILE: StudyConfig,
    "direction.toml": DesignConfig,
    "preference.toml": DesignConfig,
    "gun.toml": GunConfig,
}
"""What is recorded of a new study, with all defaults."""


class Key(NamedTuple):
    """A key that a file may lack: the table that it is of, its place, and whether its value is the default."""

    of: type[BaseModel]
    place: Place
    is_default: bool

    @property
    def dotted(self) -> str:
        return ".".join(map(str, self.place))

    def names(self, found: Sequence[KeyChange]) -> bool:
        """Whether it is named, or what lies in its table, and nothing else."""
        return bool(found) and all(f"{one.key}.".startswith(f"{self.dotted}.") for one in found)


def optional_keys(table: BaseModel, above: Place = ()) -> Iterator[Key]:
    for name, field in type(table).model_fields.items():
        value = getattr(table, name)
        if not field.is_required():
            yield Key(type(table), (*above, name), value == field.get_default(call_default_factory=True))
        yield from _inside(value, (*above, name))


def _inside(value: object, above: Place) -> Iterator[Key]:
    if isinstance(value, BaseModel):
        yield from optional_keys(value, above)
    pairs = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, tuple) else ()
    for name, inner in pairs:
        yield from _inside(inner, (*above, name))


def at(record: Any, place: Place) -> Any:
    for part in place:
        record = record[part]
    return record


def recorded_keys(config: BaseModel, record: Record) -> list[Key]:
    """Every key that is compared and need not be there, without what is in no record, as a gun's `serial`."""
    keys = (key for key in optional_keys(config) if key.place != ("synthetic",))
    return [key for key in keys if key.place[0] in record and key.place[-1] in at(record, key.place[:-1])]


def plain(record: object) -> Record:
    """A copy, as it comes back from a file."""
    found: Record = json.loads(json.dumps(record))
    return found


def without(record: Record, place: Place) -> Record:
    found = plain(record)
    del at(found, place[:-1])[place[-1]]
    return found


def altered(record: Record, place: Place) -> Record:
    found = plain(record)
    at(found, place[:-1])[place[-1]] = other(at(found, place))
    return found


def other(value: Any) -> Any:
    """Another value; whether the key could have it does not matter."""
    if isinstance(value, dict):
        return {name: other(inner) for name, inner in value.items()} or {"x": "y"}
    if isinstance(value, list):
        return [*value, "x"]
    return not value if isinstance(value, bool) else "x" if value is None else value + type(value)(1)


@cache
def setups() -> tuple[Setup[DesignConfig], ...]:
    """The shipped designs, and what none of them has: other procedures, an opening, strips."""
    gun = read_toml(shipped_folder() / "gun.toml")
    del gun["methods"]["asymmetric-2"]["voice_coil"]
    gun["methods"]["asymmetric-2"]["strips"] = {"coefficient": 0.7, "stiffness_N_m": 1300.0, "deformation_m": 5e-4}
    own = changed("direction", opening=({"text": "Welcome."},))
    adapted = (adaptive(kind) for kind in ("kesten", "up-down", "pairing"))
    return (*map(load_setup, SHIPPED), *adapted, replace(own, gun=checked_table(GunConfig, gun, "gun.toml")))


def cases() -> Iterator[tuple[Record, str, Key]]:
    """A setup as it is recorded, a part of it, and each key of that part that need not be there."""
    for setup in setups():
        record = plain(setup.record())
        for part, config in (("experiment", setup.config), ("gun", setup.gun)):
            yield from ((record, part, key) for key in recorded_keys(config, record[part]))


@pytest.mark.slow
def test_every_table_of_a_design_and_a_gun_that_is_recorded_is_looked_at() -> None:
    names = {name for model in MODELS.values() for name in model.model_json_schema()["$defs"]} - {"SerialConfig"}
    tables = {one for one in subclasses(Model) if one.__name__ in names}
    assert {one.__name__ for one in tables} == names
    optional = {one for one in tables if not all(field.is_required() for field in one.model_fields.values())}
    assert {DesignConfig, GunConfig, *optional} <= {key.of for _, _, key in cases()}


def subclasses(model: type[Model]) -> Iterator[type[Model]]:
    for one in model.__subclasses__():
        yield one
        yield from subclasses(one)


@pytest.mark.slow
def test_a_key_that_was_not_recorded_is_no_change_at_its_default_and_named_otherwise() -> None:
    for now, part, key in cases():
        then = now | {part: without(now[part], key.place)}
        for found in (setup_changes(then, now), setup_changes(now, then)):
            assert (not found) if key.is_default else key.names(found), (now["experiment"]["design"], key, found)
        assert (setup_key(then) == setup_key(now)) is key.is_default


@pytest.mark.slow
def test_a_key_that_was_recorded_otherwise_or_is_unknown_now_is_named_with_both_values() -> None:
    for now, part, key in cases():
        found = setup_changes(now | {part: altered(now[part], key.place)}, now)
        assert key.names(found), (key, found)
        value = at(now[part], key.place)
        if not isinstance(value, dict | list):
            assert [(one.key, one.frozen, one.now) for one in found] == [(key.dotted, other(value), value)]
        table = key.place[:-1]
        then = plain(now)
        at(then[part], table)["unheard_of"] = 3
        unknown = Key(key.of, (*table, "unheard_of"), is_default=False)
        assert [(one.key, one.frozen, one.now) for one in setup_changes(then, now)] == [(unknown.dotted, 3, None)]


def test_the_file_of_synthetic_answers_is_no_part_of_what_people_do() -> None:
    setup = load_setup("preference")
    before, after = (
        setup.config.model_copy(update={"synthetic": name}).model_dump(mode="json") for name in (None, "x")
    )
    assert before != after
    then, now = ({**plain(setup.record()), "experiment": one} for one in (before, after))
    assert setup_changes(then, now) == setup_changes(now, then) == []
    assert setup_key(then) == setup_key(now)
    assert [*changed_keys("preference.toml", before, after, DesignConfig)] == []


# a study and its runs


def do(study: Path, code: str, again: Again = "ask") -> Path:
    """A run as a person does it, typed by the screen of a synthetic participant; its journal."""
    setup, results = load_setup(study / "preference.toml"), study / "results"
    request = RunRequest(setup=setup, participant_id=code, results=results, seed=1, again=again, screen="terminal")
    return run(request, synthetic_screen, VirtualClock()).place.journal


@pytest.fixture(scope="module")
def template(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A study that is frozen, with a run of a person that broke off."""
    study = tmp_path_factory.mktemp("updates") / "study"
    new_study(study)
    freeze(study, "", RealClock())
    journal = do(study, "P01")
    lines = journal.read_bytes().splitlines(keepends=True)
    journal.write_bytes(b"".join(lines[: len(lines) // 2]))
    return study


@pytest.fixture
def study(template: Path, tmp_path: Path) -> Path:
    return copytree(template, tmp_path / "study")


def write_as_recorded(study: Path, recorded: Callable[[type[BaseModel], Record], Record]) -> Path:
    """The freeze and the journal, as a version would have written them that recorded configs so; the journal."""
    path = study / "preregistration-1.json"
    values = json.loads(path.read_text())
    del values["sha256"]
    for file, model in FILES.items():
        values["files"][file] = recorded(model, values["files"][file])
    frozen = Preregistration.model_validate_json(json.dumps(values))
    path.write_text(json.dumps(frozen.record()))
    (study / "preregistration-1.md").unlink()
    (journal,) = study.glob("results/sub-P01/*_journal.jsonl")
    head, *rest = raw(journal)
    setup = {part: recorded(model, head["setup"][part]) for part, model in MODELS.items()}
    of_setup = {"setup": setup, "setup_sha256": sha256(setup), "laws": recorded(SyntheticAnswers, head["laws"])}
    journal.write_bytes(forged([head | of_setup | {"preregistration_sha256": frozen.sha256}, *rest]))
    return journal


def of_no_default(model: type[BaseModel], values: Record) -> Record:
    """The record of a version that knew no key whose value is the default."""
    return model.model_validate_json(json.dumps(values)).model_dump(mode="json", exclude_defaults=True)


def test_a_study_that_an_earlier_version_froze_has_not_changed(study: Path) -> None:
    journal = write_as_recorded(study, of_no_default)
    assert "standard_interval" not in json.dumps([raw(journal)[0]["setup"], json.loads(frozen_text(study))["files"]])
    (said,) = freeze_status(study).lines()
    assert said.endswith("nothing has changed since")
    assert [*run_warnings(load_setup(study / "preference.toml"), study / "results", [journal])] == []
    assert not freeze(study, "", RealClock()).is_new


def frozen_text(study: Path) -> str:
    return (study / "preregistration-1.json").read_text()


@pytest.mark.slow
def test_a_run_that_an_earlier_version_began_goes_on_and_counts_with_later_ones(study: Path, tmp_path: Path) -> None:
    journal = write_as_recorded(study, of_no_default)
    assert len(copy_began_with(journal, tmp_path / "back")) == 3
    assert do(study, "P01", "resume") == journal
    assert read_journal(journal).finished
    do(study, "P02")
    logs = read_logs([study / "results"])
    assert [one.message for one in logs.remarks if "setups" in one.message] == []
    ((told,), _) = deviations(logs, AnalysisFiles())
    assert {one.kind for one in told.deviations} == {"order", "participants"}  # nobody did the first experiment
    export_archive(ArchiveRequest(folder=study, out=tmp_path / "archive"))
    assert "Experiment `preference`, 2 participants" in (tmp_path / "archive" / "METHODS.md").read_text()


@pytest.mark.slow
def test_a_run_goes_on_whichever_key_was_not_recorded_and_not_where_one_was_recorded_otherwise(study: Path) -> None:
    (journal,) = study.glob("results/sub-P01/*_journal.jsonl")
    began, setup = read_journal(journal), load_setup(study / "preference.toml")
    request = RunRequest(setup=setup, participant_id="P01", results=study / "results", screen="terminal")
    gun = SimulatedGun(setup.gun.renderings(setup.config.methods), VirtualClock().now)

    def resumed(part: str, values: Record) -> Plan:
        record = {**plain(setup.record()), part: values}
        head = replace(began.head, setup_json=record, setup_sha256=sha256(record))
        return resumed_plan(replace(began, head=head), request, gun)

    for part, config, file in (("experiment", setup.config, "preference.toml"), ("gun", setup.gun, "gun.toml")):
        values = plain(setup.record())[part]
        for key in recorded_keys(config, values):
            if key.is_default:
                assert resumed(part, without(values, key.place)) == began.plan
            named = re.escape(f"another config or gun file: {file}: {key.dotted}")
            with pytest.raises(NotAsItBegan, match=named):
                resumed(part, altered(values, key.place))


@pytest.mark.slow
def test_a_study_has_not_changed_whichever_key_was_not_frozen_and_has_where_one_was_frozen_otherwise(
    study: Path,
) -> None:
    config, folder = load_study(str(study / STUDY_FILE))
    loaded = [load_setup(folder / name) for name in config.experiments]
    now = files_now(study / STUDY_FILE, config, loaded)
    configs: dict[str, BaseModel] = {STUDY_FILE: config, "gun.toml": loaded[0].gun}
    configs |= {str(name): setup.config for name, setup in zip(config.experiments, loaded, strict=True)}
    assert configs.keys() == FILES.keys()
    for file, one in configs.items():
        values = plain(now[file])
        for key in recorded_keys(one, values):
            found = changes({**now, file: without(values, key.place)}, now)
            assert (not found) if key.is_default else key.names(found)
            found = changes({**now, file: altered(values, key.place)}, now)
            assert {one.file for one in found} == {file}
            assert key.names(found)


def test_a_key_that_an_earlier_version_knew_alone_is_named_by_both(study: Path) -> None:
    write_as_recorded(study, lambda model, values: values if model is SyntheticAnswers else {**values, "unheard_of": 3})
    assert [str(one) for one in freeze_status(study).changes] == [
        f"{file}: unheard_of: frozen 3, now none"
        for file in (STUDY_FILE, "direction.toml", "gun.toml", "preference.toml")
    ]
    said = r"gun file: preference.toml: unheard_of \(3, now none\), gun.toml: unheard_of \(3, now none\); resume"
    with pytest.raises(NotAsItBegan, match=said):
        do(study, "P01", "resume")
