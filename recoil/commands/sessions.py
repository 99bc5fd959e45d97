"""Commands around sessions: check a config, run, look after a study."""

from __future__ import annotations

import gc
from collections.abc import Sequence
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from analysis.report.terminal import AsJsonOption, SeedOption, each_of, end, say, show
from recoil.commands.guns import sensor_address


class ScreenChoice(StrEnum):
    """Where a run takes place."""

    terminal = "terminal"
    synthetic = "synthetic"
    console = "console"


def check(
    configs: Annotated[list[str], typer.Argument(metavar="CONFIG...", help="Files or names of shipped configs.")],
    seed: SeedOption = None,
    participants: Annotated[int, typer.Option(min=1, max=999, help="Show the orders of so many.")] = 14,
    as_json: AsJsonOption = False,
) -> None:
    """Validate configs; print design, orders, duration, drive and limits. Nothing is run."""
    from analysis.predict import check as feature

    found, refused = each_of(configs, lambda name: feature.check(name, seed, participants))
    show(found if len(found) > 1 else found[0], "\n\n".join(map(feature.check_text, found)), as_json)
    raise end(exceptions=refused > 0 or any(one.frozen and one.frozen.problems for one in found))


ParticipantOption = Annotated[
    str | None, typer.Option(help="Participant's code, 1 to 32 letters and digits; without: the start window.")
]
GunAddressOption = Annotated[str, typer.Option(help="`simulated`, `serial:PORT` or a plug-in's `NAME:...`.")]
SensorOption = Annotated[
    str | None,
    typer.Option(
        callback=sensor_address, help="Measure what is delivered: `csv:PATH`, a plug-in's `NAME:...` or `simulated`."
    ),
]
ScreenOption = Annotated[ScreenChoice, typer.Option(help="Where the run takes place.")]
ResultsOption = Annotated[Path, typer.Option(help="Folder for the logs.")]
ResumeOption = Annotated[bool, typer.Option("--resume", help="Go on with an unfinished run.")]
FreshOption = Annotated[bool, typer.Option("--fresh", help="Set an unfinished run aside and start anew.")]
WhyFreshOption = Annotated[str, typer.Option(help="With --fresh: why, for the register; never a name.")]
PracticeOption = Annotated[bool, typer.Option("--practice", help="The design's practice, in files of its own.")]
VisualOption = Annotated[bool, typer.Option("--visual", help="A synthetic participant works the console.")]
OwnScreenOption = Annotated[
    bool, typer.Option("--participant-screen", help="The participant rates on a screen of their own (PsychoPy).")
]
OwnKeysOption = Annotated[
    bool, typer.Option("--participant-keys", help="The participant answers with keys of their own (PsychoPy).")
]
NoiseOption = Annotated[
    bool, typer.Option("--noise", help="Masking white noise through the participant's headphones (PsychoPy).")
]
MonitorOption = Annotated[
    int | None, typer.Option(min=0, help="The participant's screen: 0 is the first; without: the last of several.")
]
LslOption = Annotated[
    bool, typer.Option("--lsl", help="Each shot, answer, pause and fault to Lab Streaming Layer (`recoil markers`).")
]
LanguageOption = Annotated[
    str | None, typer.Option(metavar="CODE", help="The participant's language; without: the design's, English.")
]
CataloguesOption = Annotated[
    Path | None, typer.Option(metavar="DIR", help="A folder with catalogues of your own, before those that come along.")
]
UncheckedOption = Annotated[
    bool, typer.Option("--unchecked", help="Also a language that no native speaker has checked.")
]


def run(
    config: Annotated[str, typer.Argument(help="File or name of a shipped config.")],
    participant: ParticipantOption = None,
    gun: GunAddressOption = "simulated",
    sensor: SensorOption = None,
    screen: ScreenOption = ScreenChoice.terminal,
    results: ResultsOption = Path("results"),
    seed: SeedOption = None,
    resume: ResumeOption = False,
    fresh: FreshOption = False,
    reason: WhyFreshOption = "",
    practice: PracticeOption = False,
    visual: VisualOption = False,
    participant_screen: OwnScreenOption = False,
    participant_keys: OwnKeysOption = False,
    noise: NoiseOption = False,
    participant_monitor: MonitorOption = None,
    lsl: LslOption = False,
    language: LanguageOption = None,
    catalogues: CataloguesOption = None,
    unchecked: UncheckedOption = False,
    as_json: AsJsonOption = False,
) -> None:
    """One run: a participant doing one experiment."""
    from experiments.load import load_setup
    from experiments.run_request import ParticipantOptions, RunRequest
    from recoil import session

    gc.set_threshold(50_000, 5, 1000)  # of few objects at a time: milliseconds, also while a gun is armed
    request = RunRequest(
        setup=load_setup(config),
        participant_id=participant or "",
        results=results,
        gun=gun,
        sensor=sensor or "",
        markers=lsl,
        seed=seed,
        again=session.again(resume=resume, fresh=fresh, reason=reason),
        anew_reason=reason,
        practice=practice,
        screen=screen.value,
        visual=visual,
        options=ParticipantOptions(
            screen=participant_screen, keys=participant_keys, noise=noise, monitor=participant_monitor
        ),
    )
    wanted = session.LanguageOptions(code=language, folder=catalogues, unchecked=unchecked)
    if participant is None:
        session.run_lab_day(request, wanted)
        return
    done = session.run_session(request, wanted)
    show({"journal": str(done.journal), "table": str(done.table)}, f"Done: {done.table}", as_json)


def study(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="A study's folder, or a results folder.")],
    join: Annotated[str | None, typer.Option(metavar="CODE", help="Take someone in, or correct their facts.")] = None,
    age: Annotated[int | None, typer.Option(min=1, max=120, help="With --join: age in years.")] = None,
    sex: Annotated[str | None, typer.Option(help="With --join: female, male, other or undisclosed.")] = None,
    handedness: Annotated[str | None, typer.Option(help="With --join: right, left or both.")] = None,
    exclude: Annotated[str | None, typer.Option(metavar="CODE", help="Exclude a participant; needs --reason.")] = None,
    left: Annotated[str | None, typer.Option(metavar="CODE", help="Comes no more, or was nobody; --reason.")] = None,
    readmit: Annotated[str | None, typer.Option(metavar="CODE", help="Take either back; needs --reason.")] = None,
    reason: Annotated[str | None, typer.Option(help="Why; never a name.")] = None,
    as_json: AsJsonOption = False,
) -> None:
    """The participants of a study: done, in progress, excluded, and who comes next in which orders."""
    from recoil import study as feature

    facts = {"age_years": age, "sex": sex, "handedness": handedness}
    options = {"join": join, "exclude": exclude, "left": left, "readmit": readmit}
    found, notes = feature.study(folder, feature.change(options, facts, reason))
    for message in (*notes, *found.overview.problems):
        say(f"recoil: {message}")
    show(feature.study_json(found), feature.study_text(found), as_json)
    raise end(exceptions=bool(found.overview.problems))


def watch(
    results: Annotated[Path, typer.Argument(metavar="RESULTS", help="A results folder, or a study's folder.")],
    port: Annotated[int, typer.Option(min=0, max=65535, help="A port of this machine; 0: any that is free.")] = 8477,
    as_json: AsJsonOption = False,
) -> None:
    """A read-only page on this machine about runs in progress, until interrupted: prints its address."""
    from experiments.watch import server as feature

    def tell(page: feature.WatchPage) -> None:
        show(page, f"{page.address}\nOpen it in a browser of this machine. Ctrl+C ends it.", as_json)

    feature.serve_page(results, port, tell)


def markers(
    results: Annotated[Path, typer.Argument(metavar="RESULTS", help="A results folder, or a study's folder.")],
    as_json: AsJsonOption = False,
) -> None:
    """What happens in runs, sent to Lab Streaming Layer from now on, until interrupted: prints the streams' names."""
    import threading

    from experiments.watch import lsl as feature
    from experiments.watch.folder import watched_folder

    def tell(made: feature.MarkerStreams) -> None:
        if made.problem:
            say(f"recoil: {made.problem}")
        names = " and ".join(f"“{name}”" for name in made.streams)
        show(made, f"Streams {names} ({made.source}), of runs in {made.folder}\nCtrl+C ends them.", as_json)

    feature.send_markers(watched_folder(results), tell, lambda text: say(f"recoil: {text}"), threading.Event())


def freeze(
    study: Annotated[Path, typer.Argument(metavar="STUDY", help="The study's folder.")],
    reason: Annotated[str, typer.Option(help="Of an amendment: why; never a name.")] = "",
    as_json: AsJsonOption = False,
) -> None:
    """Write a preregistration, whose hash every later journal carries; if something has changed, an amendment."""
    from analysis.archive.preregistration import freeze as feature
    from analysis.archive.preregistration import frozen_json, frozen_text
    from experiments.clock import RealClock

    found = feature(study, reason, RealClock())
    show(frozen_json(found), frozen_text(found), as_json)


def rebuild(
    journals: Annotated[list[Path], typer.Argument(metavar="JOURNAL...")], as_json: AsJsonOption = False
) -> None:
    """Make the CSV again from its journal, byte for byte."""
    from experiments.record.rebuild import rebuild_table

    built, refused = each_of(journals, rebuild_table)
    for message in (message for one in built for message in one.messages):
        say(f"recoil: {message}")
    shown = [{"table": str(one.table), "rebuilt": one.rebuilt} for one in built]
    text = "\n".join(f"{one.table}: {'rebuilt' if one.rebuilt else 'is as its journal says'}" for one in built)
    show(shown, text, as_json)
    raise end(exceptions=bool(refused or any(one.messages for one in built)))


def configs(
    copy: Annotated[Path | None, typer.Option(help="Copy the configs into this folder.")] = None,
    journal: Annotated[
        Path | None, typer.Option("--from", metavar="JOURNAL", help="With --copy: the files that its run began with.")
    ] = None,
    schema: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Write a JSON Schema of each kind of config, for editors.")
    ] = None,
    as_json: AsJsonOption = False,
) -> None:
    """List the shipped configs, copy them to edit, give back those that a run began with, or write their schemas."""
    from experiments.study.files_begun_with import copy_began_with
    from experiments.study.new_study import copy_configs, shipped
    from recoil.schemas import write_schemas

    if schema is not None:
        if copy is not None or journal is not None:
            raise typer.BadParameter("--schema stands alone: it copies no configs")
        _list_files(write_schemas(schema), as_json)
        return
    if journal is not None and copy is None:
        raise typer.BadParameter("--from goes with --copy DIR, the folder that the files are written to")
    paths = shipped() if copy is None else copy_began_with(journal, copy) if journal else copy_configs(copy)
    _list_files(paths, as_json)


def _list_files(paths: Sequence[Path], as_json: bool) -> None:
    show({"files": [str(path) for path in paths]}, "\n".join(map(str, paths)), as_json)


def new(
    study: Annotated[Path, typer.Argument(metavar="STUDY", help="The folder to make.")],
    design: Annotated[
        str, typer.Option("--from", metavar="NAME", help="A shipped design to start from; without: the paper's study.")
    ] = "",
    paper: Annotated[bool, typer.Option("--paper", help="With --from: the paper's numbers beside it.")] = False,
    as_json: AsJsonOption = False,
) -> None:
    """Make a study's folder from a template, or from a shipped design."""
    from experiments.study.new_study import new_study

    _list_files(new_study(study, design, paper=paper), as_json)
