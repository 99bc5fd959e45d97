"""One run: a participant doing an experiment, from a new or resumed journal to the table."""

from __future__ import annotations

import os
import shlex
from collections.abc import Callable
from contextlib import closing
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, Literal

from device import Gun, open_gun
from experiments import catalogue, limits
from experiments.clock import Clock, date_text
from experiments.config.setup import Setup
from experiments.design.plan import Plan
from experiments.design.streams import draw_seed
from experiments.live_run import LiveRun, RunStopped, Screen
from experiments.rebuild import plan_of, sha256, table
from experiments.record import replay, storage
from experiments.record.journal import Contents, Journal, JournalError, hold, is_empty
from experiments.record.journal import read as read_journal
from experiments.record.provenance import provenance
from experiments.record.replay import RunPosition
from experiments.runner import carry_out, gun_name
from experiments.session.steps import Answered, Rated, Session
from experiments.stimulus import Desk
from experiments.study import places, register
from experiments.study.places import Place, PlaceError

Again = Literal["ask", "resume", "fresh"]
"""What to do with an unfinished run: refuse and say what is there, go on with it, or set it aside."""
ScreenName = Literal["terminal", "synthetic", "console"]
"""Where a run is shown and worked."""


class UnfinishedRun(PlaceError):  # noqa: N818 - what is there, not what went wrong
    """An unfinished run is there; the message says when it stopped, and that it takes a decision."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ParticipantOptions:
    """What the participant has beside the console; `monitor` is the index of their screen, `None` for the last one."""

    screen: bool = False
    keys: bool = False
    noise: bool = False
    monitor: int | None = None

    @property
    def any(self) -> bool:
        """Whether the participant's own process runs at all."""
        return self.screen or self.keys or self.noise


@dataclass(frozen=True, slots=True, kw_only=True)
class RunRequest:
    """Who does what, where, at which screen, with which gun and seed.

    `seed` is `None` where the config or the system gives it. A `practice` is not analysed: it has files of its own and
    can be done again; nothing of a `training` is kept. `anew_reason` is why an unfinished run is set aside for a fresh
    one: for the register and the head of the new journal. At the console the participant may have `options` of their
    own, and a `visual` run is worked by a synthetic one.
    """

    setup: Setup[Any]
    participant_id: str
    results: Path
    gun: str = "simulated"
    seed: int | None = None
    again: Again = "ask"
    anew_reason: str = ""
    practice: bool = False
    training: bool = False
    screen: ScreenName = "synthetic"
    visual: bool = False
    options: ParticipantOptions = ParticipantOptions()


@dataclass(frozen=True, slots=True, kw_only=True)
class Finished:
    """A finished run: its plan, where it lies, and how many answers were read back from the disk."""

    plan: Plan
    place: Place
    saved: int


MakeScreen = Callable[[Setup[Any], Plan, Clock], Screen]


def resolve_seed(request: RunRequest) -> int:
    """The seed of a new run: asked for, else the config's, else drawn from the system."""
    for seed in (request.seed, request.setup.config.seed):
        if seed is not None:
            return seed
    return draw_seed()


@dataclass(frozen=True, slots=True, kw_only=True)
class _Job:
    """A run about to begin: what was asked for, where, by which clock, and the unfinished run to go on with, if any."""

    request: RunRequest
    place: Place
    clock: Clock
    before: Contents | None
    anew_reason: str = ""

    @property
    def experiment(self) -> catalogue.Experiment:
        return catalogue.experiment(self.request.setup)


def run(request: RunRequest, make_screen: MakeScreen, clock: Clock) -> Finished:
    """Carry out a run. `PlaceError`, `JournalError`, `ConfigError`, `RunStopped`: nothing acknowledged is ever lost."""
    limits.check_limits(request.setup)
    place = places.place(request.results, request.participant_id, request.setup.config.experiment)
    place = replace(place, practice=request.practice)
    anew_reason = request.anew_reason if place.journal.exists() else ""
    before = _before(place, request, clock)
    if before is None:
        _refuse_excluded(place)
    job = _Job(request=request, place=place, clock=clock, before=before, anew_reason=anew_reason)
    with closing(_open_gun(request, clock)) as gun:
        return _carry_out(job, gun, make_screen)


def _refuse_excluded(place: Place) -> None:
    reason = register.excluded(place.results).get(place.participant_id)
    if reason is not None:
        raise PlaceError(
            f"participant {place.participant_id} is excluded ({reason}); "
            "readmit them with `recoil study`, or use another code"
        )


def _open_gun(request: RunRequest, clock: Clock) -> Gun:
    methods = request.setup.gun.renderings(request.setup.config.design.methods)
    try:
        return open_gun(request.gun, methods, clock=clock.now)
    except ValueError as error:
        raise PlaceError(f"--gun {request.gun}: {error}") from error


def _before(where: Place, request: RunRequest, clock: Clock) -> Contents | None:
    """The unfinished run to go on with, if there is one and it is wanted."""
    if not where.journal.exists():
        return None
    if request.again == "fresh" or request.practice or is_empty(where.journal):
        _refuse_finished(where, _readable(where))
        os.close(hold(where.journal))  # refused while another run is at it
        _record_reason(where, request.anew_reason, clock)
        places.set_aside(where)
        return None
    contents = read_journal(where.journal)
    _refuse_finished(where, contents)
    if request.again == "ask":
        raise UnfinishedRun(_unfinished(where, contents))
    return contents


def _record_reason(where: Place, reason: str, clock: Clock) -> None:
    """Have the reason on record before anything is moved."""
    if reason:
        one = register.entry("set-aside", where.participant_id, experiment=where.experiment, reason=reason)
        register.append(where.results, one, clock)


def _refuse_finished(where: Place, contents: Contents | None) -> None:
    if contents is not None and contents.finished and not where.practice:
        raise PlaceError(
            f"participant {where.participant_id} has finished {where.experiment}: {where.journal}; "
            "one finished run a participant and experiment, so use another code"
        )


def _readable(where: Place) -> Contents | None:
    try:
        return read_journal(where.journal)
    except JournalError:
        return None


def _unfinished(where: Place, contents: Contents) -> str:
    last = contents.records[-1]
    return (
        f"participant {where.participant_id} has an unfinished run of {where.experiment}, stopped at "
        f"{date_text(str(last['utc']))} after record {last['n']}: {where.journal}; "
        "--resume goes on with it, --fresh sets it aside and starts anew"
    )


def _carry_out(job: _Job, gun: Gun, make_screen: MakeScreen) -> Finished:
    setup, plan = job.request.setup, _plan(job)
    session, screen = job.experiment.session(plan, setup), make_screen(setup, plan, job.clock)
    with _open(job) as journal:
        standing = _begin(job, plan, session, journal, gun)
        live = LiveRun(
            plan=plan,
            gun=gun,
            journal=journal,
            clock=job.clock,
            screen=screen,
            guard_s=setup.config.console.guard_s,
            told=standing.told,
        )
        desk = Desk(
            gun=gun,
            gun_name=gun_name(gun.identify()),
            drives=limits.drives(setup),
            journal=journal,
            clock=job.clock,
            live=live,
        )
        screen.begin(live)
        saved = _to_the_end(session, desk, standing, job.place)
    return Finished(plan=plan, place=job.place, saved=saved)


def _plan(job: _Job) -> Plan:
    if job.before is not None:
        _refuse_changes(job.request, job.before)
        return plan_of(job.before)
    if job.place.practice:
        return _practice(job)
    config = job.request.setup.config
    row = places.next_row(job.request.setup, job.place.results)
    return job.experiment.make_plan(config, job.place.participant_id, resolve_seed(job.request), row)


def _practice(job: _Job) -> Plan:
    config = job.request.setup.config
    plan = job.experiment.make_practice(config, job.place.participant_id, resolve_seed(job.request))
    if plan is None:
        raise PlaceError(f"{job.request.setup.source}: there is no practice (practice.trials_per_method)")
    return plan


def _refuse_changes(request: RunRequest, before: Contents) -> None:
    began, now = before.header["setup_sha256"], request.setup.sha256()
    if began != now:
        given_back = f"`recoil configs --from {shlex.quote(str(before.path))} --copy DIR`"
        raise PlaceError(
            f"{before.path}: the run began with another config or gun file (setup {began[:12]}, now {now[:12]}); "
            f"resume with the files it began with, which {given_back} gives back, or start anew (--fresh)"
        )
    seed = before.header["plan"]["seed"]
    if request.seed is not None and request.seed != seed:
        raise PlaceError(f"{before.path}: the run began with seed {seed}, not {request.seed}; leave out --seed")


def _open(job: _Job) -> Journal:
    if job.before is not None:
        return Journal.reopen(job.before, job.clock)
    try:
        storage.make_folder(job.place.folder)
    except OSError as error:
        raise PlaceError(f"{job.place.folder}: cannot be made ({error.strerror}); choose another --results") from error
    return Journal.create(job.place.journal, job.clock)


def _begin(job: _Job, plan: Plan, session: Session, journal: Journal, gun: Gun) -> RunPosition:
    """Write the head of a new journal, or stand where a resumed one broke off."""
    now = {
        "provenance": provenance(),
        "gun": asdict(gun.identify()),
        "clock": job.clock.name,
        "experimenter_knows": _experimenter_knows(job.request.setup),
    }
    if job.before is not None:
        standing = replay.replay(session, job.before)
        stopped_utc = job.before.records[-1]["utc"]
        journal.append("resumed", cut_bytes=job.before.cut_bytes, stopped_utc=stopped_utc, **now)
        return replay.go_on(session, job.before, standing, journal.append)
    setup = job.request.setup
    plan_head = {"plan": plan.record(), "plan_sha256": plan.sha256()}
    if job.anew_reason:
        plan_head["set_aside_reason"] = job.anew_reason
    journal.append("run", **plan_head, setup=setup.record(), setup_sha256=setup.sha256(), **now)
    return RunPosition(step=next(session))


def _experimenter_knows(setup: Setup[Any]) -> list[str]:
    """What the experimenter cannot be kept from knowing: they turn the gun, and set a damper by hand."""
    by_hand = [name for name in setup.config.design.methods if setup.gun.methods[name].damper]
    return ["direction", *(f"method {name}" for name in by_hand)]


def _to_the_end(session: Session, desk: Desk, standing: RunPosition, place: Place) -> int:
    """Carry out what is left. If it is stopped, the journal says why and the table holds what was answered.

    Gives back the number of answers, read back from the disk.
    """
    try:
        carry_out(session, desk, standing)
    except (KeyboardInterrupt, RunStopped) as stop:
        why = str(stop) or "interrupted"
        desk.live.end(why)
        desk.journal.append("stopped", reason=why)
        saved = _write_table(place)
        if isinstance(stop, RunStopped):
            stop.saved = saved
        raise
    except JournalError as error:
        desk.live.end(str(error))
        raise
    desk.live.end("")
    data = table(read_journal(place.journal))
    desk.journal.append("finished", table_sha256=sha256(data))
    return _write_table(place)


def _write_table(place: Place) -> int:
    """Write the table from the journal as it is read back from the disk; the answers in it."""
    contents = read_journal(place.journal)
    storage.write_whole(place.table, table(contents))
    return sum(isinstance(word, Answered | Rated) for _, word in replay.told(contents))
