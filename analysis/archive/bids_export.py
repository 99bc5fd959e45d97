"""`recoil export bids`: the logs of a folder as a BIDS data set, put in its place whole or not at all."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from analysis.archive import bids
from analysis.logs.column_map import ColumnMap
from analysis.logs.journals import journal_of
from analysis.logs.measures import scale_of_others
from analysis.logs.reading import Logs, Track, read_logs, refuse_nothing
from analysis.report import placing
from device.messages import first_few
from experiments.config.door import load
from experiments.load import load_study
from experiments.record import storage
from experiments.record.journal import read_journal
from experiments.record.provenance import recoil_version
from experiments.record.replay import history
from experiments.record.shots_table import shot_rows
from experiments.record.tables import Row
from experiments.study import register
from experiments.study.folders import PlaceError
from experiments.study.register import RegisterError
from experiments.study.study import Member


@dataclass(frozen=True, slots=True, kw_only=True)
class Exported:
    """Where the data set lies, what is in it, and what was left out with the reason.

    Runs and rows are counted by experiment; `synthetic` participants are those of whose answers a simulation gave any.
    `remarks`: what there is to say of logs that are in it; `begun`: the runs that are not, as they are not finished.
    """

    out: str
    bids_version: str
    participants: int
    synthetic: int
    runs: Mapping[str, int]
    rows: Mapping[str, int]
    files: int
    left_out: tuple[str, ...]
    remarks: tuple[str, ...] = ()
    begun: tuple[str, ...] = ()


def export(
    folder: Path,
    out: Path,
    *,
    free_text: bool = False,
    columns: Path | None = None,
    include_synthetic: bool = False,
    track: Track = iter,
) -> Exported:
    """Write the usable logs in `folder` as the data set `out`; an earlier export there is replaced.

    With `include_synthetic` data of people and of synthetic participants come into one set, where each is marked.
    `PlaceError` if no log is usable, if they are of several studies, or if `out` holds what no export wrote;
    `RegisterError` if the register cannot be trusted, since someone who was excluded might be published.
    """
    if not folder.is_dir():
        raise PlaceError(f"{folder}: no such folder; name the folder that holds the logs")
    target = Path(os.path.realpath(out))  # which a loop of links does not stop
    earlier = _earlier(target)
    mapping = load(ColumnMap, columns) if columns else None
    logs = read_logs([folder], track, mapping, include_synthetic=include_synthetic)
    refuse_nothing([folder], logs)
    results = results_of(folder, logs)
    rated = mapping.rated_from if mapping is not None else None
    runs, files = data_set_of(logs, members_of(results), name_of(results), free_text=free_text, rated_from=rated)
    with placing.in_place(target, lambda: _earlier(target)) as part:
        for path, data in (files | filled_in(earlier, files)).items():
            placing.write_file(part, path, data)
    by_task = {task: [run for run in runs.runs if run.experiment == task] for task in runs.tasks}
    return Exported(
        out=str(out),
        bids_version=bids.BIDS_VERSION,
        participants=len(runs.by_code),
        synthetic=sum(any("synthetic" in run.hands for run in done) for done in runs.by_code.values()),
        runs={task: len(done) for task, done in by_task.items()},
        rows={task: sum(len(run.rows) for run in done) for task, done in by_task.items()},
        files=len(files),
        left_out=(*map(str, logs.problems), *runs.problems),
        remarks=tuple(map(str, logs.remarks)),
        begun=tuple(map(str, logs.begun)),
    )


def data_set_of(
    logs: Logs,
    members: Mapping[str, Member],
    name: str,
    *,
    free_text: bool = False,
    rated_from: tuple[float, float] | None = None,
) -> tuple[bids.Runs, dict[str, bytes]]:
    """The runs in logs, of every kind of data that they hold, and the files of the data set that they make.

    `rated_from`: the ends of the scale of ratings that other programs recorded.
    """
    runs = bids.runs_of(logs, *logs.apart, shots=measured_shots(logs))
    if rated_from is not None and any(part.mapped for part in (logs, *logs.apart)):
        runs = replace(runs, runs=tuple(_rated_otherwise(run, rated_from) for run in runs.runs))
    return runs, bids.data_set(runs, members, name, recoil_version(), free_text=free_text)


def _rated_otherwise(run: bids.Run, rated_from: tuple[float, float]) -> bids.Run:
    """A run of ratings without the question and the words of the scale that Recoil's own have."""
    if run.experiment != "preference":
        return run
    said = scale_of_others(rated_from)
    about = f"{said.rstrip('.')}; 0 is a rating, empty means none was given"
    columns = [replace(one, description=about) if one.name == "rating" else one for one in run.columns]
    return replace(run, task=f"Each rendering method is presented and then rated. {said}", columns=tuple(columns))


def measured_shots(logs: Logs) -> dict[tuple[str, str], tuple[Row, ...]]:
    """What a sensor measured, by participant and experiment, from the journals beside the logs."""
    found = dict[tuple[str, str], tuple[Row, ...]]()
    for file in (file for part in (logs, *logs.apart) for file in part.files):
        path = Path(journal_of(str(file)))
        if not path.is_file() or _MEASURED not in path.read_bytes():
            continue
        contents = read_journal(path)
        plan = contents.plan
        found[plan.participant_id, plan.experiment] = tuple(shot_rows(plan, history(contents)))
    return found


_MEASURED = b'"kind":"measured"'


def _earlier(target: Path) -> Path | None:
    """An earlier export that is to be replaced, if there is one. `PlaceError` for anything else that is there."""
    if placing.is_free(target):
        return None
    if not is_export(target):
        raise PlaceError(f"{target}: exists and is no data set that Recoil exported; choose another --out")
    paths = (path.relative_to(target).as_posix() for path in sorted(target.rglob("*")))
    foreign = [path for path in paths if not bids.is_ours(path)]
    if foreign:
        raise PlaceError(
            f"{target}: holds what no export wrote ({first_few(foreign, 3)}); move that away, or choose another --out"
        )
    return target


def is_export(target: Path) -> bool:
    """Whether a folder says of itself that Recoil exported it."""
    generators = read_json(target / bids.DESCRIPTION).get("GeneratedBy")
    if not isinstance(generators, list):
        return False
    return any(isinstance(one, dict) and one.get("Name") == bids.GENERATOR for one in generators)


def read_json(path: Path) -> dict[str, object]:
    """What a JSON file holds; nothing if there is none."""
    try:
        values = json.loads(storage.read_whole(path))
    except (OSError, ValueError, RecursionError):
        return {}
    return values if isinstance(values, dict) else {}


def results_of(folder: Path, logs: Logs) -> Path:
    """The results folder whose logs these are. `PlaceError` if there are several: P01 here may not be P01 there."""
    files = [file for part in (logs, *logs.apart) for file in part.files]
    found = {file.parent.parent if file.parent.name.startswith("sub-") else folder for file in files}
    if len(found) > 1:
        shown = ", ".join(sorted(map(str, found)))
        raise PlaceError(f"{folder}: holds the logs of several studies ({shown}); export each by itself")
    return found.pop()


def members_of(results: Path) -> dict[str, Member]:
    """What the register says of everyone."""
    found = register.read_register(results)
    if found.problem:
        raise RegisterError(f"{found.problem}\nnothing was exported: someone might be excluded")
    return found.members


def name_of(results: Path) -> str:
    """The title of the study whose logs these are; a plain name where there is no study."""
    here = Path(os.path.normpath(results.absolute()))
    study = next((one / "study.toml" for one in (here, here.parent) if (one / "study.toml").is_file()), None)
    return load_study(str(study))[0].title if study else "Psychophysics of a haptic gun"


def filled_in(earlier: Path | None, files: Mapping[str, bytes]) -> dict[str, bytes]:
    """The JSON files that people have added keys of BIDS to, with these keys. A name that they gave is kept."""
    found = {}
    for path in (path for path in files if path.endswith(".json") and earlier):
        ours, theirs = json.loads(files[path]), read_json((earlier or Path()) / path)
        kept = {key for key in theirs if key[:1].isupper()} - (set(ours) - {"Name"})
        if kept:
            found[path] = bids.json_bytes(ours | {key: theirs[key] for key in theirs if key in kept})
    return found
