"""`recoil power`: what a study would find, before anyone is invited; by many studies of synthetic participants."""

from __future__ import annotations

import contextlib
import json
import os
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict
from pathlib import Path

from analysis.predict.jobs import RunPieces, cores, on_cluster, on_processes
from analysis.predict.power.grid import Chunk, Grid, PowerRequest, make_grid, run_chunk
from analysis.predict.power.page import grid_assumptions, in_short, sections
from analysis.predict.power.planned import Tally
from analysis.predict.power.results import Power, power_of
from analysis.report.labels import labelled
from analysis.report.page import write_page
from analysis.report.serial import as_json
from analysis.report.terminal import Progress
from experiments.config.setup import sha256
from experiments.record import storage
from experiments.record.provenance import provenance

__all__ = ["PowerRequest", "in_short", "power"]


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
    processes = on_processes(workers or cores()) if scheduler is None else on_cluster(scheduler)
    with processes as run, progress("power", len(chunks)) as tell:
        storage.make_folder(out)
        tallies = _tallies(chunks, run, kept, tell)
    found = power_of(grid, iter(tallies), grid_assumptions(grid))
    storage.write_whole(out / "power.json", as_json(found))
    with labelled(grid.labels):
        write_page(out, f"Simulated power: {grid.config.design.title}", sections(found, out / "figures"))
    kept.unlink(missing_ok=True)
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


def _tallies(chunks: Sequence[Chunk], run: RunPieces, kept: Path, tell: Callable[[str], None]) -> list[Tally]:
    """The tally of each chunk, in their order; those that `kept` holds are not worked out again."""
    found = dict(_kept(kept))
    for number in found:
        tell(_name(chunks[number]))
    missing = [number for number in range(len(chunks)) if number not in found]
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
    return [found[number] for number in range(len(chunks))]


def _kept(path: Path) -> Iterator[tuple[int, Tally]]:
    """What an interrupted run of the same job left; a line that was cut is passed over."""
    if not path.exists():
        return
    for line in path.read_bytes().splitlines():
        with contextlib.suppress(ValueError, KeyError):
            number, kept = json.loads(line)
            sums = {name: (total, squares) for name, (total, squares) in kept["sums"].items()}
            of_methods, of_error = kept["mean_squares"]
            yield (
                number,
                Tally(studies=kept["studies"], held=kept["held"], sums=sums, mean_squares=(of_methods, of_error)),
            )


def _name(chunk: Chunk) -> str:
    return f"{chunk.design.participants} people, effect {chunk.design.effect:g}"
