"""The options of `recoil design`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from analysis.report.terminal import AsJsonOption, FixedSeedOption, end, in_text, progress, show

Config = Annotated[str | None, typer.Argument(help="Config whose gun is meant; else the shipped gun.")]
Gun = Annotated[str | None, typer.Option(help="Config of a gun, instead of CONFIG.")]
Range = "FROM-TO"
Friction = Annotated[str | None, typer.Option(metavar=Range, help="Damper friction in N; from the gun's own on.")]
Voltage = Annotated[str | None, typer.Option(metavar=Range, help="Voltage in V; 0-24 unless given.")]
Pulse = Annotated[str | None, typer.Option(metavar=Range, help="Pulse in s, or one value; 0.002-0.02 unless given.")]
RateAbove = Annotated[float, typer.Option(metavar="HZ", help="Shots a second that a proposed design must keep up.")]
Grid = Annotated[int, typer.Option(help="Values of friction and of voltage; of the pulse a fifth as many.")]
Workers = Annotated[int | None, typer.Option(min=1, help="Processes; as many as cores unless given.")]


def design(
    config: Config = None,
    *,
    gun: Gun = None,
    friction: Friction = None,
    voltage: Voltage = None,
    pulse: Pulse = None,
    rate_above: RateAbove = 5.0,
    grid: Grid = 40,
    seed: FixedSeedOption = 1,
    workers: Workers = None,
    out: Annotated[Path, typer.Option(help="Folder for design.json, figures and report.")] = Path("results/design"),
    as_json: AsJsonOption = False,
) -> None:
    """Which damper, voltage and pulse would be felt best, and where a direction begins to be felt. Predictions."""
    from analysis.predict.design_search import run as feature

    request = feature.DesignRequest(
        config=config,
        gun=gun,
        friction=friction,
        voltage=voltage,
        pulse=pulse,
        rate_above_Hz=rate_above,
        grid=grid,
        seed=seed,
    )
    found = feature.design(request, workers, out, progress)
    show(found, f"{in_text(feature.in_short(found))}\nReport: {out / 'report.html'}", as_json)
    raise end(exceptions=found.best is None)
