"""Commands around the gun: simulate a shot, its twin, the rig, measured trades."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from analysis.report.terminal import (
    AsJsonOption,
    FixedSeedOption,
    GunConfigOption,
    end,
    in_text,
    progress,
    say,
    say_how_long,
    show,
)

MethodOption = Annotated[str | None, typer.Option(help="Rendering method of the gun.")]
ChangesOption = Annotated[list[str] | None, typer.Option("--set", metavar="KEY=VALUE", help="Change a parameter.")]
FidelityOption = Annotated[str | None, typer.Option(help="Model to use; full unless given.")]
SceneOption = Annotated[
    str | None, typer.Option(help="Pick the cheapest model for a use: session, figure, sweep, percept.")
]
NeedsOption = Annotated[list[str] | None, typer.Option(metavar="OUTPUT=ERROR", help="The same for a use of your own.")]
TraceOption = Annotated[
    Path | None, typer.Option(help="Write the shot over time as CSV, and beside it what it was made with.")
]
PlotOption = Annotated[Path | None, typer.Option(help="Write Figure 5's panels as PNG, SVG and PDF.")]
AuditOption = Annotated[
    bool, typer.Option("--audit", help="Add the balance: where the shot's energy and momentum went.")
]
HandOption = Annotated[
    str | None, typer.Option(metavar="KEY=VALUE,...", help="The gun in a hand; `assumed` for the usual one.")
]
StiffnessOption = Annotated[float | None, typer.Option(metavar="N/m", help="A stop that gives way.")]
VaryOption = Annotated[
    list[str] | None,
    typer.Option(metavar="KEY=VALUES", help="FROM:TO:COUNT, log:FROM:TO:COUNT or A,B,C; with --table."),
]
TableFileOption = Annotated[Path | None, typer.Option(metavar="FILE.parquet|.csv", help="Shots over all of --vary.")]
YesOption = Annotated[bool, typer.Option("--yes", help="Also more than ten million of them.")]


def simulate(
    method: MethodOption = None,
    gun: GunConfigOption = "gun",
    changes: ChangesOption = None,
    fidelity: FidelityOption = None,
    scene: SceneOption = None,
    need: NeedsOption = None,
    trace: TraceOption = None,
    plot: PlotOption = None,
    audit: AuditOption = False,
    hand: HandOption = None,
    contact_stiffness: StiffnessOption = None,
    vary: VaryOption = None,
    table: TableFileOption = None,
    yes: YesOption = False,
    as_json: AsJsonOption = False,
) -> None:
    """One shot by the model (summary, trace, figure), a table of shots over parameters that vary, or a vibration."""
    from analysis.predict.simulate import run as feature

    request = feature.SimulateRequest(
        gun=gun,
        method=method,
        changes=changes or [],
        model=feature.ModelRequest(fidelity=fidelity, scene=scene, needs=need or []),
        trace=trace,
        plot=plot,
        audit=audit,
        hand=hand,
        contact_stiffness_N_m=contact_stiffness,
        vary=vary or [],
        table=table,
        yes=yes,
    )
    found = feature.simulated(request, progress, say)
    show(found, "\n".join(map(in_text, feature.sections(found))), as_json)


def sensor_address(address: str | None) -> str | None:
    """A sensor's address as it was given. `BadParameter`: it was given, and is empty."""
    if address is not None and not address.strip():
        raise typer.BadParameter("is empty; give csv:PATH, a plug-in's NAME:... or simulated, or leave --sensor out")
    return address


def twin(
    gun: GunConfigOption = "gun",
    link: Annotated[Path | None, typer.Option(help="A path that leads to its pseudo-terminal and stays.")] = None,
    tcp: Annotated[int | None, typer.Option(min=0, max=65535, help="A TCP port of this machine instead.")] = None,
    speed: Annotated[float, typer.Option(help="So many times faster than the world.")] = 1.0,
    drift_ppm: Annotated[float, typer.Option(min=-900, max=900, help="Error of its clock, in millionths.")] = 0.0,
    wire: Annotated[int | None, typer.Option(min=0, max=9999, help="Speak another version of the wire.")] = None,
    trouble: Annotated[
        list[str] | None, typer.Option(metavar="NAME=VALUE", help="latency_s=0.005, lose=0.01, unplug=0.1, ...")
    ] = None,
    seed: FixedSeedOption = 1,
    as_json: AsJsonOption = False,
) -> None:
    """The gun's twin on a pseudo-terminal, until interrupted: prints its port, to be given to --gun."""
    from recoil import rig as feature

    asked = feature.TwinRequest(
        gun=gun, link=link, tcp=tcp, speed=speed, drift_ppm=drift_ppm, wire=wire, troubles=trouble or [], seed=seed
    )

    def tell(plugged: feature.Plugged) -> None:
        show(plugged, f"{plugged.address}\nTry: recoil doctor --gun {plugged.gun}", as_json)

    feature.serve(asked, tell)


def doctor(
    results: Annotated[Path, typer.Option(help="Folder for the logs, and its console runs.")] = Path("results"),
    gun: Annotated[str, typer.Option(help="`simulated`, `serial:PORT` or a plug-in's `NAME:...`.")] = "simulated",
    fire: Annotated[
        int, typer.Option(min=0, metavar="TRIALS", help="Fire it so often, and see that it keeps what every gun keeps.")
    ] = 0,
    sensor: Annotated[
        str | None,
        typer.Option(
            callback=sensor_address,
            help="A sensor of what is delivered: `csv:PATH`, a plug-in's `NAME:...` or `simulated`.",
        ),
    ] = None,
    gun_config: Annotated[
        str,
        typer.Option(help="Config of the gun, with the limit of its line's round trip (serial.round_trip_limit_s)."),
    ] = "gun",
    language: Annotated[
        str | None,
        typer.Option(metavar="CODE", help="A participant's language: is all of it there, and a font for it?"),
    ] = None,
    catalogues: Annotated[
        Path | None, typer.Option(metavar="DIR", help="With --language: a folder with catalogues of your own.")
    ] = None,
    out: Annotated[Path | None, typer.Option(metavar="FILE.json", help="Keep the result.")] = None,
    as_json: AsJsonOption = False,
) -> None:
    """The rig's self-test: what was measured, and what to do about what is not good."""
    from experiments.doctor.checks import LanguageAsked
    from experiments.study.folders import PlaceError
    from recoil import rig as feature

    asked = None if language is None else LanguageAsked(code=language, folder=catalogues)
    found = feature.examine(results, gun, gun_config, progress, shots=fire, sensor=sensor or "", asked=asked)
    show(found, feature.examination_text(found.checks), as_json)
    if out:
        feature.keep(found, out)
    if found.left_armed:
        raise PlaceError(found.left_armed)
    raise end(exceptions=found.verdict == "fails")


def bench(
    parts: Annotated[list[str] | None, typer.Argument(metavar="PART...", help="What to measure; else all.")] = None,
    out: Annotated[Path, typer.Option(help="Folder for bench.json and the report.")] = Path("results/bench"),
    seed: FixedSeedOption = 1,
    repeats: Annotated[int, typer.Option(min=1, help="Runs, of whose times the median is told.")] = 7,
    batch: Annotated[int, typer.Option(min=1, max=10_000_000, help="Shots of a batch.")] = 20_000,
    as_json: AsJsonOption = False,
) -> None:
    """What a digit of a shot, a trial, a person or 100 ms costs and buys here; and which post-hoc tests hold."""
    from analysis.predict.bench import run as feature

    unknown = set(parts or []) - set(feature.PARTS)
    if unknown:
        raise typer.BadParameter(f"no part {', '.join(sorted(unknown))}; there are {', '.join(feature.PARTS)}")
    request = feature.BenchRequest(seed=seed, repeats=repeats, batch=batch, progress=progress)
    chosen = list(dict.fromkeys(parts or feature.PARTS))
    if "physics" in chosen:
        say(feature.compiler_note())
    say_how_long(feature.bench_time_s(chosen, request))
    found = feature.bench(out, chosen, request)
    lines = [f"  {line}" for line in feature.trade_lines(found)]
    said = [*([feature.TRADES, *lines] if lines else []), f"Report: {out / 'report.html'}"]
    show(found.content, "\n".join(said), as_json)
