"""One run: a participant doing an experiment, from a new or resumed journal to the table."""

from __future__ import annotations

import hashlib
import os
import shlex
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, ExitStack, contextmanager, nullcontext
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING

from device import DeviceError, Gun, open_gun
from device.plugin.guard import interrupts_held
from experiments.catalogues.catalogue import ENGLISH, Language, language
from experiments.clock import Clock, date_text
from experiments.config.door import ConfigError
from experiments.config.setup import Setup
from experiments.design.config import DesignConfig
from experiments.design.plan import Plan
from experiments.design.planning import plan_of, practice_of
from experiments.design.shown_texts import setup_in
from experiments.design.stimuli import Stimuli, by_hand, stimuli_of
from experiments.design.streams import generator
from experiments.live_run import LiveRun, RunStopped, Screen
from experiments.load import check_limits
from experiments.rebuild import table
from experiments.record import replay
from experiments.record.journal import (
    Contents,
    Journal,
    JournalError,
    ShownLanguage,
    begun,
    hold_journal,
)
from experiments.record.journal import head as journal_head
from experiments.record.provenance import provenance
from experiments.record.replay import RunPosition
from experiments.run_request import RunRequest, resolve_seed
from experiments.runner import Desk, carry_out
from experiments.session.design_session import design_session
from experiments.session.history import GrowingHistory
from experiments.session.remarks import Noted
from experiments.session.steps import Session, step_record
from experiments.study import balance, folders, preregistration, register
from experiments.study.folders import Place, PlaceError
from experiments.study.register import Register
from experiments.written_tables import answers_in, tables_of_stopped, write_tables

if TYPE_CHECKING:
    from pathlib import Path

    from experiments.delivered.recorder import ShotRecorder


class UnfinishedRun(PlaceError):  # noqa: N818 - what is there, not what went wrong
    """An unfinished run is there; the message says when it stopped, and that it takes a decision."""

    def __init__(self, where: Place, contents: Contents) -> None:
        last = contents.records[-1]
        super().__init__(
            f"participant {where.participant_id} has an unfinished run of {where.experiment}, stopped at "
            f"{date_text(last.utc)} after record {last.n}: {where.journal}; "
            "--resume goes on with it, --fresh --reason TEXT sets it aside and starts anew"
        )
        self.where, self.contents = where, contents


class GunNotClosed(DeviceError):  # noqa: N818 - what is left to be done
    """A run is finished, and its gun could not be closed."""

    def __init__(self, error: DeviceError) -> None:
        super().__init__(
            f"the run is finished and everything is saved, but the gun could not be closed ({error}): it may still be "
            "armed; switch off its power"
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Finished:
    """A finished run: its plan, where it lies, and how many answers were read back from the disk."""

    plan: Plan
    place: Place
    saved: int


MakeScreen = Callable[[Setup[DesignConfig], Plan, Clock], Screen]


def run(request: RunRequest, make_screen: MakeScreen, clock: Clock) -> Finished:
    """Carry out a run. `PlaceError`, `JournalError`, `ConfigError`, `RunStopped`: nothing acknowledged is ever lost."""
    setup = request.setup
    check_limits(setup)
    shown, _ = setup_in(request.language, setup)
    stimuli = stimuli_of(setup.config, setup.gun)
    registered = register.read_register(request.results)
    place = _place(request, registered)
    if not place.journal.exists():
        request = replace(request, anew_reason="")
    before = _before(place, request, clock)
    if before is None:
        _refuse_excluded(place, registered)
    with _open_gun(request, stimuli, clock) as gun, ExitStack() as turn:
        turn.enter_context(_own_turn(place, setup.config, before))
        plan = _new_plan(request, place, registered) if before is None else _plan_of(before, request)
        stimuli.work_out(plan.trials)
        told: GrowingHistory = []
        session = design_session(plan, shown, told, request.language.messages)
        screen = make_screen(shown, plan, clock)
        with (
            _open_sensor(request, plan, stimuli, clock) as recorder,
            _open(place, before, clock, each=request.each_synced) as journal,
        ):
            head = _circumstances(request, gun, clock)
            if before is None:
                position = _begin(session, journal, request, plan, head)
                turn.close()
            else:
                position = _resume(session, journal, before, head, told)
            live = LiveRun(
                plan=plan,
                gun=recorder.gun(gun) if recorder else gun,
                journal=journal,
                clock=clock,
                screen=(screen := recorder.screen(screen) if recorder else screen),
                guard_s=setup.config.console.guard_s,
                told=told,
            )
            desk = Desk(live=live, stimuli=stimuli)
            screen.begin(live)
            if not request.sensor and _was_measured(before):
                screen.trouble(UNMEASURED)
                live.remark(Noted(trial=None, text=UNMEASURED))
            settle = recorder.settle if recorder else None
            return Finished(plan=plan, place=place, saved=_to_the_end(session, desk, position, place, settle))


def _place(request: RunRequest, registered: Register) -> Place:
    config = request.setup.config
    place = folders.place(request.results, request.participant_id, config.experiment, registered)
    return replace(place, practice=request.practice, suffix=config.table)


def _let_go(gun: Gun, why: BaseException) -> None:
    """Close the gun of a run that was broken off. `RunStopped` says that it may be armed still."""
    try:
        with interrupts_held():
            gun.close()
    except DeviceError as error:
        if _POWER in str(why):
            return
        before = "" if isinstance(why, KeyboardInterrupt) else f"{why}; "
        stop = RunStopped(f"{before}the gun did not close ({error}): {_POWER}")
        stop.saved = why.saved if isinstance(why, RunStopped) else None
        raise stop from why


_POWER = "switch off its power"


def _refuse_excluded(place: Place, registered: Register) -> None:
    reason = registered.excluded().get(place.participant_id)
    if reason is not None:
        raise PlaceError(
            f"participant {place.participant_id} is excluded ({reason}); "
            "readmit them with `recoil study`, or use another code"
        )


@contextmanager
def _open_gun(request: RunRequest, stimuli: Stimuli, clock: Clock) -> Iterator[Gun]:
    """The gun, closed at the end. A gun that cannot be closed does not hide why the run ended."""
    try:
        gun = open_gun(request.gun, stimuli.methods, clock=clock.now)
    except ValueError as error:
        raise PlaceError(f"--gun {request.gun}: {error}") from error
    try:
        yield gun
    except BaseException as why:
        _let_go(gun, why)
        raise
    try:
        with interrupts_held():
            gun.close()
    except DeviceError as error:
        raise GunNotClosed(error) from error


def _open_sensor(
    request: RunRequest, plan: Plan, stimuli: Stimuli, clock: Clock
) -> AbstractContextManager[ShotRecorder | None]:
    """What measures beside the run, if it was asked for. `SensorError`: it is refused."""
    if not request.sensor:
        return nullcontext()
    from experiments.delivered.recorder import open_recorder  # noqa: PLC0415 - a run without a sensor has none of it

    again = request.setup.config.trial.repeat_undelivered
    noise = generator(plan.seed, "sensor", plan.participant_id)
    return open_recorder(request.sensor, request.gun, stimuli.methods, clock, again=again, random=noise)


UNMEASURED = (
    "A sensor measured this run until now, and none is named any more: from here on shots are not measured. If they "
    "are to be, stop, and resume with --sensor."
)


def _was_measured(before: Contents | None) -> bool:
    """Whether a sensor took part in a run before it broke off."""
    return before is not None and any(record.kind == "measured" for record in before.records)


def _before(where: Place, request: RunRequest, clock: Clock) -> Contents | None:
    """The unfinished run to go on with; `None` if there is none, or if it was set aside."""
    if not where.journal.exists():
        return None
    anew = request.again == "fresh" or request.practice
    try:
        contents = begun(where.journal)
    except JournalError:
        if not anew:
            raise
        contents = None
    if contents is not None and _gives_way(contents, request):
        request, anew = replace(request, anew_reason=GAVE_WAY), True
    else:
        _refuse_finished(where, contents)
    os.close(hold_journal(where.journal))  # refused while another run is at it
    if contents is not None and not anew:
        if request.again == "ask":
            raise UnfinishedRun(where, contents)
        return contents
    _refuse_unsaid(where, contents, request)
    _record_reason(where, request.anew_reason, clock)
    folders.set_aside(where)
    return None


def _refuse_unsaid(where: Place, contents: Contents | None, request: RunRequest) -> None:
    """`PlaceError`: what a person answered is set aside, and nobody says why."""
    if contents is None or request.practice or request.anew_reason or contents.head.participant != "person":
        return
    if count := answers_in(contents):
        raise PlaceError(
            f"{where.journal}: has answers: {count}; --fresh sets them aside, so say why with --reason TEXT"
        )


GAVE_WAY = "a synthetic run, which gave way to a person's"


def _gives_way(contents: Contents, request: RunRequest) -> bool:
    """Whether a synthetic run stands where a person comes to: it does not use up their place."""
    synthetic = contents.head.participant == "synthetic"
    return synthetic and not request.simulated and not request.practice and request.again != "resume"


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


def _own_turn(place: Place, config: DesignConfig, before: Contents | None) -> AbstractContextManager[None]:
    is_new = before is None and not place.practice
    return folders.own_turn(place.results, config) if is_new else nullcontext()


def _new_plan(request: RunRequest, place: Place, registered: Register) -> Plan:
    setup, seed = request.setup, resolve_seed(request)
    by = request.participant_kind
    group = balance.group_of_next_run(setup, place.results, registered, by=by)
    if not request.practice:
        row = balance.row_of_next_run(setup, place.results, registered, by=by)
        return plan_of(setup.config, place.participant_id, seed, row=row, group=group)
    plan = practice_of(setup.config, place.participant_id, seed, group=group)
    if plan is None:
        raise PlaceError(f"{setup.source}: there is no practice (table [practice])")
    return plan


def _plan_of(before: Contents, request: RunRequest) -> Plan:
    """The plan of the run to go on with. `PlaceError` if the files or the seed are not those it began with."""
    began, now = before.head.setup_sha256, request.setup.sha256()
    given_back = f"`recoil configs --from {shlex.quote(str(before.path))} --copy DIR`"
    if began != now:
        raise PlaceError(
            f"{before.path}: the run began with another config or gun file (setup {began[:12]}, now {now[:12]}); "
            f"resume with the files it began with, which {given_back} gives back, or start anew (--fresh)"
        )
    plan = before.plan
    people = request.setup.laws.model_dump(mode="json") if request.setup.laws is not None else None
    if request.simulated and before.head.laws_json not in (None, people):
        raise PlaceError(
            f"{before.path}: the run began with other synthetic people than {request.setup.config.synthetic} has now; "
            f"resume with those it began with, whom {given_back} gives back, or start anew (--fresh)"
        )
    _check_same_language(before, request)
    if request.seed is not None and request.seed != plan.seed:
        raise PlaceError(f"{before.path}: the run began with seed {plan.seed}, not {request.seed}; leave out --seed")
    return plan


def _language_record(request: RunRequest) -> dict[str, object]:
    """What the head of a journal says of the participant's language: nothing where it is English alone."""
    words, one = _words_shown(request), request.language
    if words is None:
        return {}
    named = {"code": one.code, "name": one.name, "checked_by": one.checked_by}
    return {"language": {**named, "messages": words[0], "texts": words[1]}}


def _words_shown(request: RunRequest) -> tuple[dict[str, str], dict[str, str]] | None:
    """The messages of a run, and what it shows for the texts of its design; `None` where it is English alone."""
    _, texts = setup_in(request.language, request.setup)
    return None if request.language is ENGLISH else (asdict(request.language.messages), texts)


def _check_same_language(before: Contents, request: RunRequest) -> None:
    """`PlaceError` if the run began in another language, or in other words of it: it was shown so up to here."""
    began, now = before.head.language, request.language
    code = ENGLISH.code if began is None else began.code
    if code != now.code:
        raise PlaceError(f"{before.path}: the run began in {code}, not in {now.code}; resume with --language {code}")
    if _words_shown(request) != (None if began is None else (began.messages, began.texts)):
        raise PlaceError(
            f"{before.path}: the run began with another catalogue {code} than there is now; resume with the one it "
            "began with (--catalogues DIR), or start anew (--fresh)"
        )


def language_begun_in(request: RunRequest) -> ShownLanguage | None:
    """The language of the run that is there, by its journal; `None` where it is English, or nothing is on record."""
    where = folders.place(request.results, request.participant_id, request.setup.config.experiment)
    head = journal_head(where.journal) if where.journal.exists() else None
    return None if head is None else head.language


def gone_on_with(request: RunRequest) -> RunRequest:
    """A request that goes on with a run, in that run's language: that it may be used was said when the run began.

    `ConfigError`, if its catalogue is not there any more.
    """
    if request.again != "resume":
        return request
    began = language_begun_in(request)
    return replace(request, language=ENGLISH if began is None else begun_language(began.code, request.catalogues))


def begun_language(code: str, folder: Path | None) -> Language:
    """The language that a run began in. `ConfigError`, if its catalogue is not there any more."""
    try:
        return language(code, folder)
    except ConfigError as error:
        raise ConfigError(f"the run began in {code}, which it needs to go on (--catalogues DIR). {error}") from error


def _open(place: Place, before: Contents | None, clock: Clock, *, each: bool) -> Journal:
    if before is not None:
        clock.go_on_after(before.records[-1].utc)
        return Journal.reopen(before, clock, each=each)
    folders.make_results(place.folder)
    return Journal.create(place.journal, clock, each=each)


def _circumstances(request: RunRequest, gun: Gun, clock: Clock) -> dict[str, object]:
    """What a journal says of how a run began, or went on; practices and synthetic runs name the preregistration too.

    The experimenter cannot be kept from knowing the direction, as they turn the gun, and dampers, set by hand.
    """
    setup = request.setup
    frozen = preregistration.in_force(preregistration.study_folder(request.results, setup.source))
    dampers = [f"method {name}" for name in setup.config.methods if setup.gun.methods[name].damper]
    return {
        "provenance": provenance(),
        "gun": asdict(gun.identify()),
        "clock": clock.name,
        **({"sensor": request.sensor} if request.sensor else {}),
        "experimenter_knows": ["direction", *dampers, *by_hand(setup.config), *_shown_levels(setup.config)],
        **({"preregistration_sha256": frozen} if frozen else {}),
    }


def _shown_levels(design: DesignConfig) -> tuple[str, ...]:
    """The factors whose levels the experimenter is shown, once they were felt."""
    return design.adapted if design.adaptive is not None and design.adaptive.show_level else ()


def _begin(
    session: Session, journal: Journal, request: RunRequest, plan: Plan, head: Mapping[str, object]
) -> RunPosition:
    """Write the head of a new journal, and the first step."""
    setup, why = request.setup, {"set_aside_reason": request.anew_reason} if request.anew_reason else {}
    laws = {} if setup.laws is None else {"laws": setup.laws.model_dump(mode="json")}
    who = {"participant": request.participant_kind, **_language_record(request)}
    plan_head = {"plan": plan.record(), "plan_sha256": plan.sha256(), **who, **why, **laws}
    journal.append("run", **plan_head, setup=setup.record(), setup_sha256=setup.sha256(), **head)
    step = next(session)
    journal.append("step", body=step_record(step))
    return RunPosition(step=step)


def _resume(
    session: Session, journal: Journal, before: Contents, head: Mapping[str, object], told: GrowingHistory
) -> RunPosition:
    """Stand where a run broke off, and write that it goes on."""
    position = replay.replay(session, before, told)
    journal.append("resumed", cut_bytes=before.cut_bytes, stopped_utc=before.records[-1].utc, **head)
    return replay.go_on(session, before, position, journal.append)


def _to_the_end(
    session: Session, desk: Desk, position: RunPosition, place: Place, settle: Callable[[], None] | None
) -> int:
    """Carry out what is left, and have what was measured on the disk (`settle`).

    If it is stopped, the journal says why and the table holds what was answered. Gives back the number of answers,
    read back from the disk.
    """
    try:
        try:
            carry_out(session, desk, position)
        finally:
            if settle is not None:
                settle()
    except (KeyboardInterrupt, RunStopped) as stop:
        why = str(stop) or "interrupted"
        desk.live.end(why)
        desk.live.write_stop(why)
        saved = tables_of_stopped(place, desk.live.journal.read_back(), why)
        if isinstance(stop, RunStopped):
            stop.saved = saved
        raise
    except JournalError as error:
        desk.live.end(str(error))
        desk.live.fail(error)
    desk.live.end("")
    contents = desk.live.journal.read_back()
    hashes = {"table_sha256": hashlib.sha256(table(contents)).hexdigest(), "journal_sha256": contents.sha256}
    desk.live.journal.append("finished", **hashes)
    return write_tables(place, contents)
