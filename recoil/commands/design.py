"""The options of `recoil design`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from analysis.report.terminal import AsJsonOption, FixedSeedOption, WorkersOption, end, in_text, progress, show

ConfigOrGunArgument = Annotated[str | None, typer.Argument(help="Config whose gun is meant; else the shipped gun.")]
GunOption = Annotated[str | None, typer.Option(help="Config of a gun, instead of CONFIG.")]
_RANGE = "FROM-TO"
FrictionOption = Annotated[
    str | None, typer.Option(metavar=_RANGE, help="Damper friction in N; from the gun's own on.")
]
VoltageOption = Annotated[str | None, typer.Option(metavar=_RANGE, help="Voltage in V; 0-24 unless given.")]
PulseOption = Annotated[
    str | None, typer.Option(metavar=_RANGE, help="Pulse in s, or one value; 0.002-0.02 unless given.")
]
RateAboveOption = Annotated[
    float, typer.Option(metavar="HZ", help="Shots a second that a proposed design must keep up.")
]
GridOption = Annotated[int, typer.Option(help="Values of friction and of voltage; of the pulse a fifth as many.")]


def design(
    config: ConfigOrGunArgument = None,
    *,
    gun: GunOption = None,
    friction: FrictionOption = None,
    voltage: VoltageOption = None,
    pulse: PulseOption = None,
    rate_above: RateAboveOption = 5.0,
    grid: GridOption = 40,
    seed: FixedSeedOption = 1,
    workers: WorkersOption = None,
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
