"""What a notebook calls. Each function does what the command of its name does, and gives back what it found.

`RecoilError`, the root of all errors here, says in one message what is wrong, where, and what to do. The physics alone
has errors of its own: parameters that no gun can have are a `ValueError`.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from analysis.logs.reading import Logs
    from analysis.paper.audit.run import Audited
    from analysis.predict.power.grid import PowerRequest
    from analysis.predict.power.results import Power
    from analysis.predict.threshold_plan.run import ThresholdPower
    from analysis.summary.results import StudyStatistics
    from experiments.config.setup import Setup
    from experiments.design.config import DesignConfig
    from experiments.design.plan import Plan


_TARGET = 0.8


def load_config(name: str | Path) -> Setup[DesignConfig]:
    """An experiment with its gun, from a file or the name of a shipped config.

    >>> load_config("direction").config.methods
    ('vibration', 'asymmetric-1', 'asymmetric-2')
    """
    from experiments.load import load_setup
    from recoil.arguments import file_or_name

    return load_setup(file_or_name("name", name))


def plan(setup: Setup[DesignConfig], participant: str = "P01", seed: int = 1, order_row: int | None = None) -> Plan:
    """The trials of one participant in their order; the same seed gives the same plan.

    `order_row`: the row of a Latin square or Williams design, which a run takes from the register of the study.

    >>> found = plan(load_config("direction"), seed=1)
    >>> len(found.trials), found.trials[0].direction
    (60, 'forward')
    """
    from experiments.design.planning import plan_of
    from experiments.design.streams import checked_seed
    from experiments.study.folders import check_code
    from recoil.arguments import argument_error, check_setup

    check_setup("setup", setup)
    if not isinstance(participant, str):
        raise argument_error("participant", participant, "a code, such as 'P01'")
    check_code(participant)
    return plan_of(setup.config, participant, checked_seed(seed), row=order_row)


def run_synthetic(
    setup: Setup[DesignConfig], participants: Sequence[str], results: str | Path, seed: int | None = None
) -> list[Path]:
    """Runs of synthetic participants on the simulated gun, in a clock of their own; gives their tables.

    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     [table.name for table in run_synthetic(load_config("preference"), ["P01"], folder, seed=1)]
    ['sub-P01_task-preference_ratings.csv']
    """
    from experiments.clock import VirtualClock
    from experiments.run import run
    from experiments.run_request import RunRequest
    from experiments.screens.synthetic import synthetic_screen
    from recoil.arguments import argument_error, arguments_named, check_setup, path_of, texts_of

    check_setup("setup", setup)
    codes, where = texts_of("participants", participants, "codes", "P01"), path_of("results", results)
    if not codes:
        raise argument_error("participants", participants, "one code or more, such as ['P01']")
    requests = (RunRequest(setup=setup, participant_id=code, results=where, seed=seed) for code in codes)
    with arguments_named():
        return [run(request, synthetic_screen, VirtualClock()).place.table for request in requests]


def read_logs(*paths: str | Path, columns: str | Path | None = None, include_synthetic: bool = False) -> Logs:
    """The logs in files and folders as DataFrames, and `problems`: what was left out, and why.

    `trials` are those of the direction experiment, `ratings` of preference; `designs` has a `table` for each other one.
    `columns` is the file of a map for logs that Recoil did not write (`configs/examples/columns.toml`). All rows are of
    one `kind`: of people at a gun, of people at a simulated gun, or of synthetic participants. Logs of other kinds are
    problems; with `include_synthetic` they are logs of their own, `apart`. `RecoilError` if there is nothing that can
    be used.

    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     tables = run_synthetic(load_config("direction"), ["P01"], folder, seed=1)
    ...     logs = read_logs(folder)
    >>> len(logs.trials), logs.kind, logs.problems
    (60, 'synthetic', ())
    """
    from dataclasses import replace

    from analysis.logs.column_map import ColumnMap
    from analysis.logs.reading import read_logs as reading
    from experiments.config.door import ConfigError, load
    from recoil.arguments import file_of, flag_of, in_python, paths_of

    found = paths_of("paths", paths)
    mapping = None if columns is None else load(ColumnMap, file_of("columns", columns))
    logs = reading(found, mapping=mapping, include_synthetic=flag_of("include_synthetic", include_synthetic))
    logs = replace(logs, problems=tuple(replace(one, message=in_python(one.message)) for one in logs.problems))
    if not logs.files:
        nothing = (f"{', '.join(map(str, paths))}: no logs of Recoil",)
        raise ConfigError("\n".join(map(str, (*logs.problems, *logs.begun) or nothing)))
    return logs


def analyze(
    *paths: str | Path,
    columns: str | Path | None = None,
    include_synthetic: bool = False,
    requests: str | Path | None = None,
    fits: bool = False,
) -> StudyStatistics:
    """The statistics of all logs in files and folders; `to_frame()`, `to_dict()`, and a table in a notebook.

    `columns` and `include_synthetic` are those of `read_logs`: statistics of other kinds of data than `data_kind` are
    `kept_apart`. `requests`: a file of further tests and models (`examples/requests.toml`), whose answers are
    `requested`. `fits`: with the diffusion model fitted. Who was left out stands in `excluded`, and what there is to
    say in `warnings`. `RecoilError` if there is nothing that can be used.

    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     tables = run_synthetic(load_config("direction"), ["P01", "P02", "P03"], folder, seed=1)
    ...     found = analyze(folder)
    >>> found.direction.anova.df
    (2, 4)
    """
    from dataclasses import replace

    from analysis.summary.analyze import with_everybody
    from analysis.summary.request_data import answers_to
    from analysis.summary.requests import Requests
    from analysis.summary.summary import summarize
    from device.messages import few_of_each
    from experiments.config.door import load
    from recoil.arguments import file_of, flag_of

    asked = load(Requests, file_of("requests", requests)) if requests is not None else None
    fitted = flag_of("fits", fits)
    logs = read_logs(*paths, columns=columns, include_synthetic=include_synthetic)
    found = with_everybody(summarize(logs, fits=fitted), logs)
    if asked is not None and requests is not None:
        found = replace(found, requested=answers_to(asked, Path(requests), replace(logs, apart=())))
    left_out = (f"left out: {one}" for one in (*logs.problems, *logs.begun))
    said = few_of_each([*left_out, *map(str, (*logs.remarks, *logs.notes)), *found.warnings])
    return replace(found, warnings=tuple(said))


def audit(paper: str | Path = "paper") -> Audited:
    """Whether data could give the published numbers: of a paper's file, or of a shipped one.

    >>> found = audit()
    >>> found.findings[0].quote, found.findings[0].result.verdict
    ('14 participants (7 males and 7 females)', 'attainable')
    """
    from analysis.paper.audit.run import audit_file
    from recoil.arguments import file_or_name

    return audit_file(file_or_name("paper", paper))


def power(
    config: str | Path,
    *,
    participants: str | int | Sequence[int] = (),
    trials: str | int | Sequence[int] = (),
    effects: str | float | Sequence[float] = (),
    methods: Sequence[str] = (),
    studies: int | None = None,
    target: float = _TARGET,
    seed: int = 1,
) -> Power | ThresholdPower:
    """Simulated power of a config's design, in this process; what is left out is as the config has it.

    Numbers may be a list, or text as on the command line, such as `"8,10,14-20"`. `studies`: 10,000 unless given. Of a
    design with a threshold: by procedure and `trials`, how well it would be known, from so many people (200).

    >>> found = power("preference", participants=14, studies=50)
    >>> {design.participants for design in found.designs}
    {14}
    """
    from analysis.predict.power.grid import PowerRequest
    from analysis.predict.power.run import simulated_power
    from experiments.design.streams import checked_seed
    from recoil.arguments import arguments_named, count_of, file_or_name, numbers_of, share_argument, texts_of

    name = file_or_name("config", config)
    counted = None if studies is None else count_of("studies", studies, 10_000_000)
    request = PowerRequest(
        config=name,
        participants=numbers_of("participants", participants),
        trials=numbers_of("trials", trials),
        effects=numbers_of("effects", effects),
        methods=texts_of("methods", methods, "names", "vibration"),
        studies=counted or 10_000,
        target=share_argument("target", target),
        seed=checked_seed(seed),
    )
    if (plan := _threshold_plan(request, counted)) is not None:
        return plan
    with arguments_named():
        return simulated_power(request)


def _threshold_plan(request: PowerRequest, people: int | None) -> ThresholdPower | None:
    """The plan of a threshold; `None` of a config that has none."""
    from analysis.predict.threshold_plan.run import (
        PEOPLE,
        TRACK_TRIALS,
        ThresholdRequest,
        procedures_of,
        threshold_power,
    )
    from experiments.config.door import ConfigError
    from recoil.arguments import arguments_named

    with arguments_named():
        if not procedures_of(request.config):
            return None
        given = {"participants": request.participants, "effects": request.effects, "methods": request.methods}
        unused = [name for name, value in given.items() if value]
        unused += ["target"] if request.target != _TARGET else []
        if unused:
            said = f"{request.config} has a threshold, of which only trials and studies are asked"
            raise ConfigError(f"{', '.join(unused)}: {said}")
        return threshold_power(
            ThresholdRequest(
                config=request.config,
                trials=request.trials or TRACK_TRIALS,
                people=people or PEOPLE,
                seed=request.seed,
            )
        )
