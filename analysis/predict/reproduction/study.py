"""A study to reproduce, and its runs, each gone on with where a reproduction was stopped.

Every part is the one that live sessions use; only the clock is virtual, so that breaks take no time.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

from analysis.paper.audit.run import PaperFile, load_paper_file
from analysis.paper.paper import Paper, load_paper
from analysis.predict.reproduction.people import answers_table, misfit, reconstructed_people, table_name
from analysis.report.terminal import Tell
from experiments.clock import VirtualClock
from experiments.config.door import ConfigError, StudyConfig
from experiments.config.setup import Setup, sha256
from experiments.design.config import DesignConfig
from experiments.load import load_setup, load_study
from experiments.record import storage
from experiments.record.journal import begun
from experiments.record.names import Place
from experiments.record.provenance import git_commit, recoil_version
from experiments.record.rebuild import rebuild
from experiments.run import run
from experiments.run_request import RunRequest
from experiments.screens.synthetic import synthetic_screen
from experiments.study import folders

MANIFEST = "reproduction.json"

Synthetic = Literal["reconstructed", "rates"]
"""Who answers: participants rebuilt from the published numbers, or those that the configs describe."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ReproducedStudy:
    """A study ready to run: its config, its experiments' setups, the seed and the published numbers.

    `answering`: the setups with the participants who answer; `claims`: what is audited of these.
    """

    config: StudyConfig
    setups: tuple[Setup[DesignConfig], ...]
    answering: tuple[Setup[DesignConfig], ...]
    seed: int
    paper: Paper | None
    claims: PaperFile | None = None
    notes: tuple[str, ...] = ()

    @property
    def reconstructed(self) -> bool:
        """Are the participants rebuilt from the published numbers?"""
        return self.answering != self.setups

    @property
    def runs(self) -> list[tuple[Setup[DesignConfig], str]]:
        """Each experiment with each participant."""
        return [(setup, code) for code in self.config.codes() for setup in self.answering]

    def manifest(self) -> dict[str, object]:
        """What makes one reproduction the same as another."""
        setups = sha256([setup.record() for setup in self.answering])
        people = [setup.laws.model_dump(mode="json") for setup in self.answering if setup.laws is not None]
        return {
            "seed": self.seed,
            "participants": self.config.codes(),
            "setups_sha256": setups,
            "people_sha256": sha256(people),
            "recoil": recoil_version(),
            "git_commit": git_commit(),
        }


def prepared(name: str, seed: int, synthetic: Synthetic | None = None) -> ReproducedStudy:
    """A study from its config, with reconstructed participants unless others are asked for or those do not fit it.

    `ConfigError` for configs that cannot be used, and if reconstructed participants are asked for and do not fit.
    """
    config, folder = load_study(name)
    setups = tuple(load_setup(folder / experiment) for experiment in config.experiments)
    paper = load_paper(folder / config.paper) if config.paper else None
    claims = load_paper_file(folder / config.paper) if config.paper else None
    study = ReproducedStudy(config=config, setups=setups, answering=setups, seed=seed, paper=paper, claims=claims)
    reason = "other participants were asked for" if synthetic == "rates" else misfit(config, setups, paper)
    if synthetic == "reconstructed" and reason:
        raise ConfigError(f"{name}: no reconstructed participants: {reason}")
    if paper is None or reason:
        return replace(study, notes=(f"The participants are those of the configs: {reason}.",))
    answering, notes = reconstructed_people(config, setups, paper, seed)
    return replace(study, answering=answering, notes=notes)


def claim_folder(study: ReproducedStudy, out: Path) -> None:
    """Make `out` this study's: go on with the same, set aside another, refuse what is not a reproduction."""
    manifest, wanted = out / MANIFEST, study.manifest()
    if manifest.is_file():
        if _manifest_values(manifest) == wanted:
            return
        storage.set_aside_file(out)
    elif out.exists() and (not out.is_dir() or any(out.iterdir())):
        raise folders.PlaceError(f"{out}: exists and is no reproduction of a study; choose another --out")
    storage.make_folder(out)
    for setup in study.answering if study.reconstructed else ():
        storage.write_whole(out / table_name(setup), answers_table(setup))
    storage.write_whole(manifest, (json.dumps(wanted, indent=1) + "\n").encode())


def _manifest_values(manifest: Path) -> object:
    """What the manifest of an earlier reproduction holds; `PlaceError` where that is no JSON."""
    try:
        return json.loads(storage.read_whole(manifest))
    except (OSError, ValueError, RecursionError) as error:
        rule = "is no manifest of a reproduction that can be read; move its folder away, or choose another --out"
        raise folders.PlaceError(f"{manifest}: {rule}") from error


def do_runs(study: ReproducedStudy, logs: Path, tell: Tell) -> None:
    """Every run that the logs do not hold yet, one after the other: orders may be balanced over who came before."""
    for setup, code in study.runs:
        _take_part(study, setup, code, logs)
        tell(f"{code} {setup.config.experiment}")


def _take_part(study: ReproducedStudy, setup: Setup[DesignConfig], code: str, results: Path) -> None:
    """Have a synthetic participant do an experiment, unless the logs hold it already."""
    where = folders.place(results, code, setup.config.experiment)
    if not _finished(where):
        request = RunRequest(
            setup=setup, participant_id=code, results=results, seed=study.seed, again="resume", synced_at_end=True
        )
        run(request, synthetic_screen, VirtualClock())
    elif not where.table.exists():  # killed between the last record and the table
        table, data, _ = rebuild(where.journal)
        storage.write_whole(table, data)


def _finished(where: Place) -> bool:
    before = begun(where.journal) if where.journal.exists() else None
    return before is not None and before.finished
