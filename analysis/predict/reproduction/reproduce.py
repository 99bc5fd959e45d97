"""`recoil reproduce`: a whole study with synthetic participants on the simulated gun, and the odds of its pattern.

Every part is the one that live sessions use; only the clock is virtual, so that breaks take no time. The odds are over
participants of the same config, whose logs are not written.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from analysis.logs.reading import Logs, read_logs
from analysis.paper.audit import audit
from analysis.paper.audit.paper_file import load_paper_file
from analysis.paper.audit.run import Finding
from analysis.paper.audit.sentences import ATTENTION, ELSEWHERE, other_rows, predictions
from analysis.paper.odds import Odds, chance_recurs, odds_of, recurs
from analysis.paper.paper import Paper, load_paper
from analysis.paper.published import Row, compare
from analysis.predict.power import studies as power_studies
from analysis.predict.reproduction.reconstructed import misfit, seat, table_bytes, table_name
from analysis.predict.simulate.shot import shot_panel
from analysis.summary.sections.data import ReportData
from analysis.summary.sections.sections import obtained_text, write_report
from analysis.summary.summary import summarize
from device.parameters import GunParameters
from experiments.catalogue import rebuild
from experiments.clock import VirtualClock
from experiments.config.door import ConfigError
from experiments.config.models import StudyConfig
from experiments.config.setup import Setup, sha256
from experiments.design.streams import Stream, generator
from experiments.direction.config import DirectionConfig
from experiments.load import load_setup, load_study
from experiments.preference.config import PreferenceConfig
from experiments.preference.synthetic import draw_ratings
from experiments.record import storage
from experiments.record.journal import begun
from experiments.record.provenance import git_commit, provenance, recoil_version
from experiments.run import RunRequest, run
from experiments.screens.synthetic import synthetic_screen
from experiments.study import places

Scores = NDArray[np.float64]
Counts = NDArray[np.int64]


def direction_counts(config: DirectionConfig, methods: list[str], n: int, replications: int, seed: int) -> Counts:
    """Correct answers, (replications, n, methods, 2 directions), of people drawn as `RatesParticipant` draws them."""
    counts = power_studies.direction_counts(config, n, replications, generator(seed, "odds", config.experiment))
    return counts[:, :, [config.design.methods.index(method) for method in methods]]


def preference_scores(config: PreferenceConfig, methods: list[str], n: int, replications: int, seed: int) -> Scores:
    """Ratings, (replications, n, methods), of people drawn as `RatingsParticipant` draws them."""
    stream = Stream(seed, "odds", config.experiment)
    law, scale = config.synthetic.ratings, config.rating
    people = (draw_ratings(law, scale, methods, stream) for _ in range(replications * n))
    ratings = [person[method] for person in people for method in methods]
    return np.array(ratings).reshape(replications, n, len(methods))


def direction_odds(config: DirectionConfig, paper: Paper, replications: int, seed: int) -> Odds:
    """The odds of experiment 1's claims at the published rates."""
    published, rates, forward = paper.direction, config.synthetic.rates, config.design.forward_per_session
    counts = direction_counts(config, published.methods, published.n, replications, seed)
    claims = recurs(counts[..., 0] / forward, published)
    return odds_of(
        config.experiment,
        claims | chance_recurs(counts.sum(axis=1), published.n * forward, published),
        f"{published.n} people whose correct rates are, in the mean, the published ones; people differ by an ability "
        f"of SD {rates.ability_sd:g} and a bias of SD {rates.bias_sd:g} in probit units (assumed); "
        f"{forward} forward and as many backward trials a method; seed {seed}.",
    )


def preference_odds(config: PreferenceConfig, paper: Paper, replications: int, seed: int) -> Odds:
    """The odds of experiment 2's claims at the assumed ratings."""
    published, law = paper.preference, config.synthetic.ratings
    scores = preference_scores(config, published.methods, published.n, replications, seed)
    means = ", ".join(f"{method} {law.mean[method]:g}" for method in published.methods)
    return odds_of(
        config.experiment,
        recurs(scores, published),
        f"{published.n} people; the means and SDs are not published, so these are assumed: {means}; SD between people "
        f"{law.person_sd:g}, within {law.noise_sd:g}; a share of {law.same_share:g} give "
        f"{' and '.join(law.same or ())} the same score; seed {seed}.",
    )


MANIFEST = "reproduction.json"

Observer = Literal["reconstructed", "rates"]
"""Who answers: participants rebuilt from the published numbers, or those that the configs describe."""

Tell = Callable[[str], None]
"""Told what was done, once a run and once a part of the analysis."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Study:
    """A study ready to run: its config, its experiments' setups, the seed and the published numbers.

    `seated`: the setups with the participants who answer; `findings`: the audit of the published numbers.
    """

    config: StudyConfig
    setups: tuple[Setup[Any], ...]
    seated: tuple[Setup[Any], ...]
    seed: int
    paper: Paper | None
    findings: tuple[Finding, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def reconstructed(self) -> bool:
        """Are the participants rebuilt from the published numbers?"""
        return self.seated != self.setups

    @property
    def runs(self) -> list[tuple[Setup[Any], str]]:
        """Each experiment with each participant."""
        return [(setup, code) for code in self.config.codes() for setup in self.seated]

    def manifest(self) -> dict[str, object]:
        """What makes one reproduction the same as another."""
        setups = sha256([setup.record() for setup in self.seated])
        return {
            "seed": self.seed,
            "participants": self.config.codes(),
            "setups_sha256": setups,
            "recoil": recoil_version(),
            "git_commit": git_commit(),
        }


@dataclass(frozen=True, slots=True, kw_only=True)
class Reproduced:
    """The statistics of a reproduction, and every published number beside what was obtained."""

    statistics: dict[str, Any]
    comparison: tuple[Row, ...]


def load(name: str, seed: int, observer: Observer | None = None) -> Study:
    """A study from its config, with reconstructed participants unless others are asked for or those do not fit it.

    `ConfigError` for configs that cannot be used, and if reconstructed participants are asked for and do not fit.
    """
    config, folder = load_study(name)
    setups = tuple(load_setup(str(folder / experiment)) for experiment in config.experiments)
    paper = load_paper(folder / config.paper) if config.paper else None
    findings = audit(load_paper_file(folder / config.paper)) if config.paper else ()
    study = Study(config=config, setups=setups, seated=setups, seed=seed, paper=paper, findings=findings)
    reason = "other participants were asked for" if observer == "rates" else misfit(config, setups, paper)
    if observer == "reconstructed" and reason:
        raise ConfigError(f"{name}: no reconstructed participants: {reason}")
    if paper is None or reason:
        return replace(study, notes=(f"The participants are those of the configs: {reason}.",))
    seated = seat(config, setups, paper, seed)
    return replace(study, seated=seated.setups, notes=seated.notes)


def reproduce(study: Study, out: Path, tell: Tell) -> Reproduced:
    """Run, log, analyse and report a study into `out`.

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
    comparison = tuple(_compared(study, statistics))
    write_report(out, _report(study, logs, statistics, odds, comparison))
    tell("report")
    return Reproduced(statistics=statistics, comparison=comparison)


def as_text(comparison: tuple[Row, ...]) -> str:
    """Every published number with its verdict, for the terminal."""
    if not comparison:
        return "No published numbers to compare with."
    rows = [("verdict", "published", "obtained", "number"), *map(_cells, comparison)]
    widths = [max(len(row[column]) for row in rows) for column in range(3)]
    lines = ["  ".join([*map(str.ljust, row, widths), row[3]]) for row in rows]
    notes = [f"{row.quantity}, published {row.published}: {row.note}" for row in comparison if _remarkable(row)]
    return "\n".join([*lines, *([""] if notes else []), *notes])


def _cells(row: Row) -> tuple[str, str, str, str]:
    apart = row.experiment == ELSEWHERE
    name = row.quantity if apart else f"{row.experiment}: {row.quantity}"
    return row.verdict, _shortened(row.published, 20), "" if apart else obtained_text(row), _shortened(name, 72)


def _shortened(text: str, most: int) -> str:
    return text if len(text) <= most else f"{text[: most - 1]}…"


def _remarkable(row: Row) -> bool:
    """Does the verdict call for its reason?"""
    return bool(row.note) and row.verdict in {"differs", "differs as predicted", *ATTENTION}


def _compared(study: Study, statistics: dict[str, Any]) -> Iterator[Row]:
    """Every published number: those that logs hold beside the obtained, the others with the audit's verdict."""
    if study.paper is not None:
        yield from compare(statistics, study.paper, predictions(study.findings))
        yield from other_rows(study.findings)


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
    for setup in study.seated if study.reconstructed else ():
        storage.write_whole(out / table_name(setup), table_bytes(setup))
    storage.write_whole(manifest, (json.dumps(wanted, indent=1) + "\n").encode())


def _seat(study: Study, setup: Setup[Any], code: str, results: Path) -> None:
    """Have a synthetic participant do an experiment, unless the logs hold it already."""
    where = places.place(results, code, setup.config.experiment)
    if not _finished(where):
        request = RunRequest(setup=setup, participant_id=code, results=results, seed=study.seed, again="resume")
        run(request, synthetic_screen, VirtualClock())
    elif not where.table.exists():  # killed between the last record and the table
        table, data, _ = rebuild(where.journal)
        storage.write_whole(table, data)


def _finished(where: places.Place) -> bool:
    before = begun(where.journal) if where.journal.exists() else None
    return before is not None and before.finished


def _odds(study: Study) -> Iterator[Odds]:
    if study.paper is None or not study.config.replications:
        return
    for setup in study.setups:
        if isinstance(setup.config, DirectionConfig) and setup.config.synthetic.observer == "rates":
            yield direction_odds(setup.config, study.paper, study.config.replications, study.seed)
        if isinstance(setup.config, PreferenceConfig) and setup.config.synthetic.observer == "ratings":
            yield preference_odds(setup.config, study.paper, study.config.replications, study.seed)


def _report(
    study: Study, logs: Logs, statistics: dict[str, Any], odds: tuple[Odds, ...], comparison: tuple[Row, ...]
) -> ReportData:
    people = "synthetic, reconstructed from the published numbers" if study.reconstructed else "synthetic"
    return ReportData(
        title=study.config.title,
        statistics=statistics,
        problems=logs.problems,
        comparison=comparison or None,
        odds=odds,
        panels=tuple(_panels(study.setups[0])),
        files=logs.files,
        provenance=provenance() | {"seed": str(study.seed), "participants": people, "gun": "simulated"},
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
    yield from study.notes
    gun = study.setups[0].gun
    coil = gun.coil
    yield f"The coil after the pulse is {coil.drive_off}, its back-EMF is {coil.emf}; the paper leaves both open."
    for setup in study.setups:
        keys = ", ".join(setup.config.assumed)
        yield f"Assumed or fitted for {setup.config.experiment}, not in the paper: {keys}."
    yield f"Assumed for the gun, not in the paper: {', '.join(gun.assumed)}."
