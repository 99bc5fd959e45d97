"""Commands around the gun: simulate a shot, its twin, the rig, measured trades."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated, Any

import typer

from analysis.report.terminal import (
    AsJson,
    FixedSeed,
    GunConfig,
    end,
    progress,
    say,
    show,
)


def simulate(
    method: Annotated[str | None, typer.Option(help="Rendering method of the gun.")] = None,
    gun: GunConfig = "gun",
    changes: Annotated[list[str] | None, typer.Option("--set", metavar="KEY=VALUE", help="Change a parameter.")] = None,
    fidelity: Annotated[str | None, typer.Option(help="Model to use; full unless given.")] = None,
    scene: Annotated[
        str | None, typer.Option(help="Pick the cheapest model for a use: session, figure, sweep, percept.")
    ] = None,
    need: Annotated[
        list[str] | None, typer.Option(metavar="OUTPUT=ERROR", help="The same for a use of your own.")
    ] = None,
    trace: Annotated[Path | None, typer.Option(help="Write the shot over time as CSV.")] = None,
    plot: Annotated[Path | None, typer.Option(help="Write Figure 5's panels as PNG and SVG.")] = None,
    audit: Annotated[bool, typer.Option("--audit", help="Where energy and momentum went.")] = False,
    hand: Annotated[
        str | None, typer.Option(metavar="KEY=VALUE,...", help="The gun in a hand; `assumed` for the usual one.")
    ] = None,
    contact_stiffness: Annotated[float | None, typer.Option(metavar="N/m", help="A stop that gives way.")] = None,
    vary: Annotated[
        list[str] | None,
        typer.Option(metavar="KEY=VALUES", help="FROM:TO:COUNT, log:FROM:TO:COUNT or A,B,C; with --table."),
    ] = None,
    table: Annotated[Path | None, typer.Option(metavar="FILE.parquet|.csv", help="Shots over all of --vary.")] = None,
    yes: Annotated[bool, typer.Option("--yes", help="Also more than ten million of them.")] = False,
    as_json: AsJson = False,
) -> None:
    """One shot by the model (summary, trace, figure), a table of shots over parameters that vary, or a vibration."""
    from analysis.predict.simulate import more as shot_more
    from analysis.predict.simulate import scene as shot_scene
    from analysis.predict.simulate import shot
    from experiments.load import find

    single: dict[str, object] = {"--audit": audit or None, "--hand": hand, "--contact-stiffness": contact_stiffness}
    models: dict[str, object] = {"--fidelity": fidelity, "--scene": scene, "--need": need, "--set": changes}
    others = single | models | {"--vary": vary, "--table": table}
    if _vibration(find(gun), method, trace, plot, _given(others), as_json):
        return
    parameters = shot.parameters_of(find(gun), method, changes or [])
    wanted = shot_scene.ModelRequest(fidelity=fidelity, scene=scene, needs=need or [])
    model, told = shot_scene.picked(wanted, parameters, vary or [])
    if vary or table:
        _sweep(
            told,
            as_json,
            gun=parameters,
            fidelity=model,
            vary=vary or [],
            changes=changes or [],
            table=table,
            instead=_given({"--trace": trace, "--plot": plot} | single),
            yes=yes,
        )
        return
    found = shot.summary_of(parameters, model) | told
    if told:
        told["scene"] |= shot_scene.contact_of(wanted, parameters, found["summary"]["impact_speed_m_s"])
    found |= shot_more.asked_for(parameters, found["summary"], audit, hand, contact_stiffness)
    if trace:
        shot.write_trace(parameters, trace)
    if plot:
        shot.write_plot(parameters, plot)
    show(found, shot_scene.with_scene(told, shot.as_text(found)), as_json)


def _given(options: dict[str, object]) -> list[str]:
    return [name for name, value in options.items() if value is not None]


def _vibration(
    gun_file: Path, method: str | None, trace: Path | None, plot: Path | None, others: list[str], as_json: bool
) -> bool:
    """Whether the method is a vibration, which is then told of."""
    from analysis.predict.simulate import vibration as shot_vibration

    parameters = shot_vibration.vibration_of(gun_file, method)
    if parameters is None:
        return False
    found = shot_vibration.tell(parameters, trace, plot, others)
    show(found, shot_vibration.as_text(found), as_json)
    return True


def _sweep(told: dict[str, Any], as_json: bool, **asked: Any) -> None:
    from analysis.predict.simulate import scene as shot_scene
    from analysis.predict.simulate import sweep

    if note := sweep.interpreted_note():
        say(note)
    found = sweep.sweep(sweep.SweepRequest(**asked), progress) | told
    show(found, shot_scene.with_scene(told, sweep.as_text(found)), as_json)


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
    from recoil import twin as feature

    asked = feature.TwinRequest(
        gun=gun, link=link, tcp=tcp, speed=speed, drift_ppm=drift_ppm, wire=wire, troubles=trouble or [], seed=seed
    )

    def tell(found: dict[str, Any]) -> None:
        show(found, f"{found['address']}\nTry: recoil doctor --gun {found['gun']}", as_json)
        sys.stdout.flush()

    feature.serve(asked, tell)


def doctor(
    results: Annotated[Path, typer.Option(help="Folder for the logs, and its console runs.")] = Path("results"),
    gun: Annotated[str, typer.Option(help="`simulated` or `serial:PORT`. It is not fired.")] = "simulated",
    gun_config: Annotated[
        str,
        typer.Option(help="Config of the gun, with the limit of its line's round trip (serial.round_trip_limit_s)."),
    ] = "gun",
    out: Annotated[Path | None, typer.Option(metavar="FILE.json", help="Keep the result.")] = None,
    as_json: AsJson = False,
) -> None:
    """The rig's self-test: what was measured, and what to do about what is not good."""
    from recoil import doctor as feature

    found = feature.examine(results, gun, gun_config, progress)
    show(found, feature.as_text(found.checks), as_json)
    if out:
        feature.keep(found, out)
    raise end(exceptions=found.verdict == "fails")


def bench(
    parts: Annotated[list[str] | None, typer.Argument(metavar="PART...", help="What to measure; else all.")] = None,
    out: Annotated[Path, typer.Option(help="Folder for bench.json and the report.")] = Path("results/bench"),
    seed: FixedSeed = 1,
    repeats: Annotated[int, typer.Option(min=1, help="Runs, of whose times the median is told.")] = 7,
    batch: Annotated[int, typer.Option(min=1, help="Shots of a batch.")] = 200_000,
    as_json: AsJson = False,
) -> None:
    """Measure our own methods: error rates of the post-hoc tests, error against time of a simulated shot."""
    from analysis.predict.bench import run as feature
    from analysis.predict.bench.physics import BenchRequest

    unknown = set(parts or []) - set(feature.PARTS)
    if unknown:
        raise typer.BadParameter(f"no part {', '.join(sorted(unknown))}; there are {', '.join(feature.PARTS)}")
    asked = BenchRequest(seed=seed, repeats=repeats, batch=batch, figures=out / "figures", progress=progress)
    found, lines = feature.bench(out, parts or [], asked)
    show(found, "\n".join([*lines, f"Report: {out / 'report.html'}"]), as_json)
