"""Commands around the gun: simulate a shot, its twin, the rig, measured trades."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated, Any

import typer

from experiments.roof.commands.speaking import (
    AsJson,
    FixedSeed,
    GunConfig,
    end,
    progress,
    show,
)


def simulate(
    method: Annotated[str | None, typer.Option(help="Rendering method of the gun.")] = None,
    gun: GunConfig = "gun",
    changes: Annotated[list[str] | None, typer.Option("--set", metavar="KEY=VALUE", help="Change a parameter.")] = None,
    fidelity: Annotated[str, typer.Option(help="Model to use.")] = "full",
    trace: Annotated[Path | None, typer.Option(help="Write the shot over time as CSV.")] = None,
    plot: Annotated[Path | None, typer.Option(help="Write Figure 5's panels as PNG and SVG.")] = None,
    as_json: AsJson = False,
) -> None:
    """One shot by the model: summary, trace, figure."""
    from experiments.load import find
    from experiments.roof import shot

    parameters = shot.parameters_of(find(gun), method, changes or [])
    found = shot.summary_of(parameters, fidelity)
    if trace:
        shot.write_trace(parameters, trace)
    if plot:
        shot.write_plot(parameters, plot)
    show(found, shot.as_text(found), as_json)


def twin(
    gun: GunConfig = "gun",
    link: Annotated[Path | None, typer.Option(help="A path that leads to its pseudo-terminal and stays.")] = None,
    tcp: Annotated[int | None, typer.Option(min=0, max=65535, help="A TCP port of this machine instead.")] = None,
    speed: Annotated[float, typer.Option(help="So many times faster than the world.")] = 1.0,
    drift_ppm: Annotated[float, typer.Option(min=-900, max=900, help="Error of its clock, in millionths.")] = 0.0,
    wire: Annotated[int | None, typer.Option(min=0, max=9999, help="Speak another version of the wire.")] = None,
    trouble: Annotated[
        list[str] | None, typer.Option(metavar="NAME=VALUE", help="latency_s=0.005, lose=0.01, unplug=0.1, ...")
    ] = None,
    seed: FixedSeed = 1,
    as_json: AsJson = False,
) -> None:
    """The gun's twin on a pseudo-terminal, until interrupted: prints its port, to be given to --gun."""
    from experiments.roof import twin as roof

    asked = roof.Asked(
        gun=gun, link=link, tcp=tcp, speed=speed, drift_ppm=drift_ppm, wire=wire, troubles=trouble or [], seed=seed
    )

    def tell(found: dict[str, Any]) -> None:
        show(found, f"{found['address']}\nTry: recoil doctor --gun {found['gun']}", as_json)
        sys.stdout.flush()

    roof.serve(asked, tell)


def doctor(
    results: Annotated[Path, typer.Option(help="Folder for the logs, and its console runs.")] = Path("results"),
    gun: Annotated[str, typer.Option(help="`simulated` or `serial:PORT`. It is not fired.")] = "simulated",
    out: Annotated[Path | None, typer.Option(metavar="FILE.json", help="Keep the result.")] = None,
    as_json: AsJson = False,
) -> None:
    """The rig's self-test: what was measured, and what to do about what is not good."""
    from experiments.roof import doctor as roof

    findings = roof.examine(results, gun, progress)
    found = roof.as_json(findings)
    show(found, roof.as_text(findings), as_json)
    if out:
        roof.keep(found, out)
    raise end(exceptions=bool(roof.fails(findings)))


def bench(
    parts: Annotated[list[str] | None, typer.Argument(metavar="PART...", help="What to measure; else all.")] = None,
    out: Annotated[Path, typer.Option(help="Folder for bench.json and the report.")] = Path("results/bench"),
    seed: FixedSeed = 1,
    as_json: AsJson = False,
) -> None:
    """Measure our own methods: error rates of the post-hoc tests."""
    from experiments.roof import bench as roof

    unknown = set(parts or []) - set(roof.PARTS)
    if unknown:
        raise typer.BadParameter(f"no part {', '.join(sorted(unknown))}; there are {', '.join(roof.PARTS)}")
    found = roof.bench(out, seed, parts or [], progress)
    show(found, f"Report: {out / 'report.html'}", as_json)
