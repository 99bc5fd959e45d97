"""`recoil power`: what a study would find, before anyone is invited; by many studies of synthetic participants."""

from __future__ import annotations

import contextlib
import json
import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import asdict
from pathlib import Path
from shlex import quote

from pydantic import TypeAdapter

from analysis.predict.drawn import RatingStudies
from analysis.predict.jobs import RunPieces, on_cluster, on_processes
from analysis.predict.power.grid import Chunk, Grid, PowerRequest, make_grid, run_chunk
from analysis.predict.power.page import grid_assumptions, in_short, sections
from analysis.predict.power.planned import Tally
from analysis.predict.power.results import Power, power_of
from analysis.predict.power.shards import (
    Job,
    Shard,
    ShardNumber,
    most_common_job,
    read_shard,
    shard_number,
    shards_in,
    tallies_of,
    write_shard,
)
from analysis.report import placing
from analysis.report.copies import cores
from analysis.report.labels import labelled
from analysis.report.page import write_page
from analysis.report.serial import as_json
from analysis.report.terminal import Progress
from experiments.config.door import ConfigError
from experiments.config.setup import sha256
from experiments.record import storage
from experiments.record.provenance import provenance

__all__ = [
    "PowerRequest",
    "in_short",
    "merged_power",
    "power",
    "power_shard",
    "power_time_s",
    "shard_in_short",
    "shard_number",
]

_AROUND_S = 3.0  # start, figures and report
_RATES_S, _JUDGES_S = 0.5e-6, 2.2e-6  # of a person who rates, or tells directions, on one core


def power_time_s(
    request: PowerRequest, workers: int | None = None, scheduler: str | None = None, part: ShardNumber | None = None
) -> float:
    """About how long that takes, or one part of it; 0 on a cluster, of which nobody knows."""
    if scheduler is not None:
        return 0.0
    chunks = make_grid(request).chunks()
    numbers = range(len(chunks)) if part is None else part.pieces(chunks)
    each_s = [one.people * (_RATES_S if isinstance(one.config, RatingStudies) else _JUDGES_S) for one in chunks]
    return _AROUND_S + sum(each_s[number] for number in numbers) / (workers or cores())


def power(
    request: PowerRequest, out: Path, progress: Progress, workers: int | None = None, scheduler: str | None = None
) -> Power:
    """Simulate, analyse, write `power.json`, report and figures into `out`; what was found is returned.

    The work is done on so many processes (all cores unless told), or on a Dask cluster.

    What was done before an interruption is kept there, and the same request goes on with it.
    """
    grid = make_grid(request)
    chunks = grid.chunks()
    kept = out / f"unfinished-{job_of(grid)[:12]}.jsonl"
    placing.check_for_another(out, placing.POWER_FILE)
    with _processes(workers, scheduler) as run:
        tallies = _tallies(chunks, range(len(chunks)), run, kept, progress)
    found = _written(grid, tallies, out)
    kept.unlink(missing_ok=True)
    return found


def power_shard(
    request: PowerRequest,
    part: ShardNumber,
    out: Path,
    progress: Progress,
    *,
    workers: int | None = None,
    scheduler: str | None = None,
) -> tuple[Shard, bool]:
    """One part of what `power` simulates, as a file in `out`, and whether it was there: it is not worked out again."""
    grid = make_grid(request)
    chunks, job = grid.chunks(), _job(grid)
    if there := _already(out / part.file_name, part, job):
        return there, True
    kept = out / f"unfinished-{job.sha256[:12]}-{part.number}-of-{part.of}.jsonl"
    with _processes(workers, scheduler) as run:
        tallies = _tallies(chunks, part.pieces(chunks), run, kept, progress)
    shard = Shard(part=part, job=job, tallies=tallies)
    write_shard(out, shard)
    kept.unlink(missing_ok=True)
    return shard, False


def _already(path: Path, part: ShardNumber, job: Job) -> Shard | None:
    """The shard at its place; none if it is missing or damaged. `ConfigError`: another is there; `OSError`: no file."""
    storage.check_file(path)
    try:
        there = read_shard(path)
    except ConfigError:
        return None
    if differing := there.job.unlike(job) or (there.part != part and f"{there.part}, not {part}"):
        raise ConfigError(f"{path}: holds a shard of another job ({differing}); give another --out, or delete it")
    return there


def merged_power(folder: Path, request: PowerRequest, out: Path) -> Power:
    """What all shards in a folder come to, written into `out` as `power` would have written it.

    A request without a config means that of most of the shards; any other must be theirs. `ConfigError` names each
    shard that is not whole, of another job, doubled or missing.
    """
    shards = shards_in(folder)
    first = most_common_job(shards)
    grid = make_grid(request) if request.config else _grid_of(first, shards[first], request)
    tallies = tallies_of(folder, shards, _job(grid))
    return _written(grid, tallies, out)


def _grid_of(path: Path, shard: Shard, request: PowerRequest) -> Grid:
    theirs = shard.job.request
    if request != PowerRequest(config=""):
        raise ConfigError(
            "--merge without CONFIG takes the options of the shards: leave others out, or name CONFIG too"
        )
    try:
        return make_grid(theirs)
    except ConfigError as error:
        raise ConfigError(
            f"{error}\n{path}: was run with config {theirs.config} and paper {theirs.paper}; merge in the folder where "
            "the jobs were started, or give CONFIG and the options of the jobs"
        ) from error


def shard_in_short(shard: Shard, out: Path, *, was_there: bool) -> str:
    """What is told of a shard that is done."""
    pieces = (
        f"{len(shard.tallies)} piece{'s' * (len(shard.tallies) != 1)} of work"
        if shard.tallies
        else "no work is left for it: fewer shards would do"
    )
    done = " (done before and left as it is)" if was_there else ""
    file = out / shard.part.file_name
    merge = f"when all are there: recoil power --merge {quote(str(out))}"
    return f"Shard {shard.part}{done}: {pieces}\nFile: {file}; {merge}"


def _processes(workers: int | None, scheduler: str | None) -> AbstractContextManager[RunPieces]:
    return on_processes(workers or cores()) if scheduler is None else on_cluster(scheduler)


def _written(grid: Grid, tallies: Mapping[int, Tally], out: Path) -> Power:
    """`power.json`, report and figures of the tallies of all chunks."""
    found = power_of(grid, (tallies[number] for number in range(len(tallies))), grid_assumptions(grid))
    with placing.results_in(out, placing.POWER_FILE) as part, labelled(grid.labels):
        storage.write_whole(part / placing.POWER_FILE, as_json(found))
        write_page(part, f"Simulated power: {grid.config.design.title}", sections(found, part / "figures"))
    return found


def simulated_power(request: PowerRequest) -> Power:
    """What `power` finds, worked out in this process; nothing is written."""
    grid = make_grid(request)
    return power_of(grid, map(run_chunk, grid.chunks()), grid_assumptions(grid))


def job_of(grid: Grid) -> str:
    """The hash of all that the tallies depend on."""
    published = grid.published.model_dump(mode="json") if grid.published else None
    chunks = [
        (
            c.design.key,
            c.number,
            c.studies,
            c.config.design.model_dump(mode="json"),
            c.config.law.model_dump(mode="json"),
            c.felt and asdict(c.felt),
        )
        for c in grid.chunks()
    ]
    return sha256([provenance(), grid.request.seed, grid.request.null, published, chunks])


def _job(grid: Grid) -> Job:
    return Job(sha256=job_of(grid), request=grid.request, provenance=provenance())


def _tallies(
    chunks: Sequence[Chunk], numbers: Sequence[int], run: RunPieces, kept: Path, progress: Progress
) -> dict[int, Tally]:
    """The tallies of the chunks of these numbers; those that `kept` holds are not worked out again."""
    with progress("power", len(numbers)) as tell:
        storage.make_folder(kept.parent)
        found = dict(_kept(kept))
        for number in found:
            tell(_name(chunks[number]))
        missing = [number for number in numbers if number not in found]
        descriptor = storage.reopen(kept) if kept.exists() else storage.create(kept)
        if found or os.fstat(descriptor).st_size:
            storage.write_all(descriptor, b"\n")  # after a line that a kill may have cut

        def keep(place: int, tally: Tally) -> None:
            number = missing[place]
            found[number] = tally
            storage.write_all(descriptor, json.dumps([number, asdict(tally)]).encode() + b"\n")
            tell(_name(chunks[number]))

        try:
            run(run_chunk, [chunks[number] for number in missing], keep)
        finally:
            os.close(descriptor)
            if not found:
                kept.unlink(missing_ok=True)
    return {number: found[number] for number in numbers}  # however they ended, so that a shard has the same bytes


_KEPT = TypeAdapter(tuple[int, Tally])


def _kept(path: Path) -> Iterator[tuple[int, Tally]]:
    """What an interrupted run of the same job left; a line that was cut is passed over."""
    if not path.exists():
        return
    for line in path.read_bytes().splitlines():
        with contextlib.suppress(ValueError):
            yield _KEPT.validate_python(json.loads(line))


def _name(chunk: Chunk) -> str:
    return f"{chunk.design.participants} people, effect {chunk.design.effect:g}"
