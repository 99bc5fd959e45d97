"""`recoil reproduce`: a whole study with synthetic participants on the simulated gun, from plans to the report.

Every part is the one that live sessions use; only the clock is virtual, so that breaks take no time.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from analysis.logs import Logs, read_logs
from analysis.odds import Odds
from analysis.paper import Paper, load_paper
from analysis.published import Row, compare
from analysis.report import ReportData, write_report
from analysis.summary import summarize
from device.parameters import GunParameters
from experiments import places, storage
from experiments.canonical import sha256
from experiments.clock import VirtualClock
from experiments.config import StudyConfig
from experiments.direction.config import DirectionConfig
from experiments.journal import is_empty
from experiments.journal import read as read_journal
from experiments.load import ConfigError, load_setup, load_study
from experiments.preference.config import PreferenceConfig
from experiments.provenance import git_commit, provenance, recoil_version
from experiments.roof.odds import direction_odds, preference_odds
from experiments.roof.pictures import shot_panel
from experiments.run import Request, rebuild, run
from experiments.screens.synthetic import synthetic_screen
from experiments.setup import Setup

MANIFEST = "reproduction.json"

Tell = Callable[[str], None]
"""Told what was done, once a run and once a part of the analysis."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Study:
    """A study ready to run: its config, its experiments' setups, the seed and the published numbers."""

    config: StudyConfig
    setups: tuple[Setup[Any], ...]
    seed: int
    paper: Paper | None

    @property
    def runs(self) -> list[tuple[Setup[Any], str]]:
        """Each experiment with each participant."""
        return [(setup, code) for code in self.config.codes() for setup in self.setups]

    def manifest(self) -> dict[str, object]:
        """What makes one reproduction the same as another."""
        setups = sha256([setup.record() for setup in self.setups])
        return {
            "seed": self.seed,
            "participants": self.config.codes(),
            "setups_sha256": setups,
            "recoil": recoil_version(),
            "git_commit": git_commit(),
        }


def load(name: str, seed: int) -> Study:
    """A study from its config."""
    config, folder = load_study(name)
    try:
        paper = load_paper(folder / config.paper) if config.paper else None
    except ValueError as error:
        raise ConfigError(str(error)) from error
    setups = tuple(load_setup(str(folder / experiment)) for experiment in config.experiments)
    return Study(config=config, setups=setups, seed=seed, paper=paper)


def reproduce(study: Study, out: Path, tell: Tell) -> dict[str, Any]:
    """Run, log, analyse and report a study into `out`; the statistics are returned.

    An unfinished reproduction of the same study is gone on with; another one in `out` is set aside.
    """
    _claim(study, out)
    for setup, code in study.runs:
        _seat(study, setup, code, out / "logs")
        tell(f"{code} {setup.config.experiment}")
    logs = read_logs([out / "logs"])
    statistics = summarize(logs)
    tell("statistics")
    odds = tuple(_odds(study))
    tell("odds of the published pattern")
    write_report(out, _report(study, logs, statistics, odds))
    tell("report")
    return statistics


def _claim(study: Study, out: Path) -> None:
    """Make `out` this study's: go on with the same, set aside another, refuse what is not a reproduction."""
    manifest, wanted = out / MANIFEST, study.manifest()
    if manifest.is_file():
        if json.loads(manifest.read_text(encoding="utf-8")) == wanted:
            return
        places.set_aside_file(out)
    elif out.exists() and (not out.is_dir() or any(out.iterdir())):
        raise places.PlaceError(f"{out}: exists and is no reproduction of a study; choose another --out")
    storage.make_folder(out)
    storage.write_whole(manifest, (json.dumps(wanted, indent=1) + "\n").encode())


def _seat(study: Study, setup: Setup[Any], code: str, results: Path) -> None:
    """Have a synthetic participant do an experiment, unless the logs hold it already."""
    where = places.place(results, code, setup.config.experiment)
    if not _finished(where):
        request = Request(setup=setup, participant_id=code, results=results, seed=study.seed, again="resume")
        run(request, synthetic_screen, VirtualClock())
    elif not where.table.exists():  # killed between the last record and the table
        table, data, _ = rebuild(where.journal)
        storage.write_whole(table, data)


def _finished(where: places.Place) -> bool:
    return where.journal.exists() and not is_empty(where.journal) and read_journal(where.journal).finished


def _odds(study: Study) -> Iterator[Odds]:
    if study.paper is None or not study.config.replications:
        return
    for setup in study.setups:
        if isinstance(setup.config, DirectionConfig) and setup.config.synthetic.observer == "rates":
            yield direction_odds(setup.config, study.paper, study.config.replications, study.seed)
        if isinstance(setup.config, PreferenceConfig) and setup.config.synthetic.observer == "ratings":
            yield preference_odds(setup.config, study.paper, study.config.replications, study.seed)


def _report(study: Study, logs: Logs, statistics: dict[str, Any], odds: tuple[Odds, ...]) -> ReportData:
    comparison: tuple[Row, ...] | None = compare(statistics, study.paper) if study.paper else None
    return ReportData(
        title=study.config.title,
        statistics=statistics,
        problems=logs.problems,
        comparison=comparison,
        odds=odds,
        panels=tuple(_panels(study.setups[0])),
        files=logs.files,
        provenance=provenance() | {"seed": str(study.seed), "participants": "synthetic", "gun": "simulated"},
        notes=tuple(_notes(study)),
    )


def _panels(setup: Setup[Any]) -> Iterator[Any]:
    for method in setup.config.design.methods:
        parameters = setup.gun.rendering(method)
        if isinstance(parameters, GunParameters):
            label = setup.gun.methods[method].label
            yield shot_panel(f"{label} (friction {parameters.friction_N:g} N)", parameters)


def _notes(study: Study) -> Iterator[str]:
    """What the numbers rest on beyond the paper."""
    gun = study.setups[0].gun
    coil = GunParameters(**gun.voice_coil)
    yield f"The coil after the pulse is {coil.drive_off}, its back-EMF is {coil.emf}; the paper leaves both open."
    for setup in study.setups:
        keys = ", ".join(setup.config.assumed)
        yield f"Assumed or fitted for {setup.config.experiment}, not in the paper: {keys}."
    yield f"Assumed for the gun, not in the paper: {', '.join(gun.assumed)}."
