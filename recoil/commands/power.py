"""The options of `recoil power`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from analysis.report.terminal import (
    AsJsonOption,
    ConfigArgument,
    FixedSeedOption,
    WorkersOption,
    in_text,
    progress,
    show,
)

ParticipantsOption = Annotated[str | None, typer.Option(metavar="N,N-N", help="How many people, such as 8,10,14-20.")]
TrialsListOption = Annotated[
    str | None, typer.Option(metavar="N,N-N", help="Trials of a method; the config's own unless given.")
]
MethodsOption = Annotated[
    list[str] | None, typer.Option(metavar="NAME,NAME", help="Compare these alone; may come again.")
]
EffectOption = Annotated[
    str | None, typer.Option(metavar="FACTOR,FACTOR", help="Factors on what people feel; 1 is the config.")
]
SimulatedOption = Annotated[int, typer.Option(min=1, max=10_000_000, help="Simulated studies of each design.")]
NullOption = Annotated[bool, typer.Option("--null", help="People who feel no difference: false positives.")]
SchedulerOption = Annotated[str | None, typer.Option(metavar="ADDRESS", help="Work on this Dask cluster instead.")]


def power(
    config: ConfigArgument,
    *,
    participants: ParticipantsOption = None,
    trials: TrialsListOption = None,
    methods: MethodsOption = None,
    effect: EffectOption = None,
    studies: SimulatedOption = 10_000,
    target: Annotated[float, typer.Option(help="Power that a design is to reach.")] = 0.8,
    null: NullOption = False,
    seed: FixedSeedOption = 1,
    paper: Annotated[str, typer.Option(help="Published numbers whose pattern may recur.")] = "paper",
    workers: WorkersOption = None,
    scheduler: SchedulerOption = None,
    out: Annotated[Path, typer.Option(help="Folder for power.json, figures and report.")] = Path("results/power"),
    as_json: AsJsonOption = False,
) -> None:
    """Simulated power and precision: how many people and trials does it take, and what does it cost?"""
    from analysis.predict.power import run as feature

    request = feature.PowerRequest(
        config=config,
        participants=participants,
        trials=trials,
        methods=tuple(methods or ()),
        effects=effect,
        studies=studies,
        target=target,
        null=null,
        seed=seed,
        paper=paper,
    )
    found = feature.power(request, feature.Where(workers=workers, scheduler=scheduler), out, progress)
    show(found, f"{in_text(feature.in_short(found))}\nReport: {out / 'report.html'}", as_json)
