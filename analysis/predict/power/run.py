"""`recoil power`: what a study would find, before anyone is invited; by many studies of synthetic participants."""

from __future__ import annotations

import contextlib
import json
import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from analysis.paper.odds import SIGNIFICANT, WHOLE_PATTERN
from analysis.predict.jobs import Run, cores, on_cluster, on_processes
from analysis.predict.power.grid import Cell, Grid, Request, make_grid
from analysis.predict.power.page import sections
from analysis.predict.power.planned import Option, Tally, merged, precisions, shares, smallest
from analysis.predict.power.studies import PUBLISHED, Chunk, run_chunk
from analysis.predict.power.words import as_text, assumptions
from analysis.report.page import write_page
from analysis.report.terminal import Progress
from experiments.config.setup import sha256
from experiments.record import storage
from experiments.record.provenance import provenance

__all__ = ["Request", "Where", "as_text", "power"]

Facts = dict[str, Any]


@dataclass(frozen=True, slots=True, kw_only=True)
class Where:
    """Where the work is done: on so many processes (all cores unless told), or on a Dask cluster."""

    workers: int | None = None
    scheduler: str | None = None


def power(request: Request, where: Where, out: Path, progress: Progress) -> Facts:
    """Simulate, analyse, write `power.json`, report and figures into `out`; the content of `power.json` is returned.

    What was done before an interruption is kept there, and the same request goes on with it.
    """
    grid = make_grid(request)
    chunks = grid.chunks()
    kept = out / f"unfinished-{job_of(grid)[:12]}.jsonl"
    with _workers(where) as run, progress("power", len(chunks)) as tell:
        storage.make_folder(out)
        tallies = _tallies(chunks, run, kept, tell)
    found = _facts(grid, iter(tallies))
    data = (json.dumps(found, indent=1, ensure_ascii=False, allow_nan=False) + "\n").encode()
    storage.write_whole(out / "power.json", data)
    write_page(out, f"Simulated power: {grid.config.title}", sections(found, out / "figures"))
    kept.unlink(missing_ok=True)
    return found


def job_of(grid: Grid) -> str:
    """The hash of all that the tallies depend on."""
    published = grid.published.model_dump(mode="json") if grid.published else None
    chunks = [
        (c.design.key, c.number, c.studies, c.config.design.model_dump(mode="json"), c.felt and asdict(c.felt))
        for c in grid.chunks()
    ]
    config = grid.config.model_dump(mode="json")
    return sha256([provenance(), grid.request.seed, grid.request.null, config, published, chunks])


def _workers(where: Where) -> AbstractContextManager[Run]:
    return on_processes(where.workers or cores()) if where.scheduler is None else on_cluster(where.scheduler)


def _tallies(chunks: Sequence[Chunk], run: Run, kept: Path, tell: Callable[[str], None]) -> list[Tally]:
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
        with contextlib.suppress(ValueError):
            number, kept = json.loads(line)
            sums = {name: (total, squares) for name, (total, squares) in kept["sums"].items()}
            yield number, Tally(studies=kept["studies"], held=kept["held"], sums=sums)


def _name(chunk: Chunk) -> str:
    return f"{chunk.design.participants} people, effect {chunk.design.effect:g}"


def _facts(grid: Grid, tallies: Iterator[Tally]) -> Facts:
    """The content of `power.json`."""
    cells, request = grid.all_cells, grid.request
    of_cells = [merged([next(tallies) for _ in grid.chunks_of(cell)]) for cell in cells]
    designs = [_design(cell, tally) for cell, tally in zip(cells, of_cells, strict=True)]
    return {
        "experiment": grid.config.experiment,
        "title": grid.config.title,
        "seed": request.seed,
        "studies": request.studies,
        "level": SIGNIFICANT,
        "target": request.target,
        "null": request.null,
        "designs": designs[: len(grid.cells)],
        "smallest": [] if request.null else _smallest(designs[: len(grid.cells)], request.target),
        "published_pattern": _pattern(designs[cells.index(grid.reference)]) if grid.reference else None,
        "assumptions": assumptions(grid),
        "provenance": provenance(),
    }


def _design(cell: Cell, tally: Tally) -> Facts:
    return {
        **asdict(cell.design),
        "methods": list(cell.design.methods),
        "duration_s": cell.duration_s,
        "lab_hours": cell.lab_hours,
        "too_long": cell.too_long,
        "claims": [asdict(share) for share in shares(tally)],
        "precision": [asdict(one) for one in precisions(tally)],
    }


def _pattern(design: Facts) -> Facts:
    """The published claims at the paper's own design."""
    claims = [one for one in design["claims"] if one["claim"].startswith(PUBLISHED)]
    whole = next(one for one in claims if one["claim"] == f"{PUBLISHED}, {WHOLE_PATTERN}")
    return {
        "participants": design["participants"],
        "trials": design["trials"],
        "lab_hours": design["lab_hours"],
        "share": whole["share"],
        "ci_low": whole["ci_low"],
        "ci_high": whole["ci_high"],
        "claims": claims,
    }


def _smallest(designs: Sequence[Facts], target: float) -> list[Facts]:
    """For each effect and set of methods: the cheapest design at which each claim holds often enough."""
    found = []
    for effect, methods in dict.fromkeys((one["effect"], tuple(one["methods"])) for one in designs):
        group = [one for one in designs if (one["effect"], tuple(one["methods"])) == (effect, methods)]
        for place, claim in enumerate(one["claim"] for one in group[0]["claims"]):
            reached = [one["claims"][place] for one in group]
            options = [
                Option(
                    lab_hours=one["lab_hours"],
                    participants=one["participants"],
                    ci_low=share["ci_low"],
                    allowed=not one["too_long"],
                )
                for one, share in zip(group, reached, strict=True)
            ]
            best = smallest(options, target)
            design = None if best is None else _named(group[best]) | reached[best]
            most = max(reached, key=lambda one: one["share"])
            found.append(
                {"claim": claim, "effect": effect, "methods": list(methods), "design": design, "most": most["share"]}
            )
    return found


def _named(design: Facts) -> Facts:
    return {key: design[key] for key in ("participants", "trials", "lab_hours")}
