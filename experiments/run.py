"""One run: a participant doing an experiment, from a new or resumed journal to the table."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import AbstractContextManager, ExitStack, contextmanager, nullcontext
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING

from device import DeviceError, Gun, open_gun
from device.interrupts import interrupts_held
from experiments.clock import Clock
from experiments.config.setup import Setup
from experiments.design.config import DesignConfig
from experiments.design.limits import check_limits
from experiments.design.plan import Plan
from experiments.design.planning import plan_of, practice_of
from experiments.design.shown_texts import setup_in
from experiments.design.stimuli import Stimuli, by_hand, stimuli_of
from experiments.design.streams import generator
from experiments.earlier_run import (
    EarlierRun,
    begins_halted,
    earlier_run,
    give_way,
    resumed_plan,
    what_changed,
    words_shown,
)
from experiments.live_run import LiveRun, RunStopped, Screen
from experiments.record import replay, storage
from experiments.record.dictionary import design_dictionary
from experiments.record.head_design import began_with
from experiments.record.journal import (
    Contents,
    Head,
    Journal,
    JournalError,
)
from experiments.record.journal import head as journal_head
from experiments.record.names import Place
from experiments.record.owed_shot import owed_shots
from experiments.record.provenance import provenance
from experiments.record.rebuild import shots_table, table
from experiments.record.replay import RunPosition
from experiments.record.tables import is_simulated
from experiments.run_request import RunRequest, resolve_seed
from experiments.runner import Desk, carry_out
from experiments.session.design_session import design_session
from experiments.session.history import GrowingHistory
from experiments.session.remarks import HALTED_BEFORE, Noted
from experiments.session.steps import Session, step_record
from experiments.study import balance, folders, preregistration, register
from experiments.study.folders import PlaceError
from experiments.study.register import Register

if TYPE_CHECKING:
    from pathlib import Path

    from experiments.delivered.recorder import ShotRecorder


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
    _refuse_person(request, place, registered)
    earlier = earlier_run(place, request)
    before = earlier.before
    with _open_gun(request, stimuli, clock) as gun, ExitStack() as turn:
        turn.enter_context(_own_turn(place, setup.config, before))
        plan = _new_plan(request, place, registered) if before is None else resumed_plan(before, request, gun)
        stimuli.work_out(plan.trials)
        told: GrowingHistory = []
        session = design_session(plan, shown, told, request.language.messages)
        screen = make_screen(shown, plan, clock)
        with (
            _open_sensor(request, plan, stimuli, clock) as recorder,
            _open(place, earlier, clock, each=request.each_synced) as journal,
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
            _tell(live, screen, what_changed(before, request, gun))
            position = _halted_before(position, place, before, live)
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
        if isinstance(why, RunStopped):
            stop.saved, stop.halted = why.saved, why.halted
        raise stop from why


_POWER = "switch off its power"


def _refuse_person(request: RunRequest, place: Place, registered: Register) -> None:
    """`PlaceError` for whoever is excluded or left, and for a practice where there is none."""
    if request.practice:
        folders.refuse_without_practice(request.setup)
    member = registered.trusted().get(place.participant_id)
    if member is not None and member.gone:
        raise PlaceError(
            f"participant {place.participant_id} {member.gone}; "
            "readmit them with `recoil study`; somebody else has a code of their own"
        )


@contextmanager
def _open_gun(request: RunRequest, stimuli: Stimuli, clock: Clock) -> Iterator[Gun]:
    """The gun, closed at the end. A gun that cannot be closed does not hide why the run ended.

    `JournalError`: whether it owes a test shot cannot be read; that is said before anything begins.
    """
    if not is_simulated(request.gun):
        owed_shots(request.results)
    try:
        gun = open_gun(request.gun, stimuli.methods, clock=clock.now)
    except ValueError as error:
        raise PlaceError(f"gun {request.gun}: {error}") from error
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


def _own_turn(place: Place, config: DesignConfig, before: Contents | None) -> AbstractContextManager[None]:
    is_new = before is None and not place.practice
    return folders.own_turn(place.results, config) if is_new else nullcontext()


def _new_plan(request: RunRequest, place: Place, registered: Register) -> Plan:
    """The plan of a new run; one that gives way to it has no part in the balance any more."""
    setup, seed = request.setup, resolve_seed(request)
    by = request.participant_kind

    def of_others(path: Path) -> Head | None:
        return None if path == place.journal else journal_head(path)

    group = balance.group_of_next_run(setup, place.results, registered, of_others, by=by)
    if not request.practice:
        row = balance.row_of_next_run(setup, place.results, registered, of_others, by=by)
        return plan_of(setup.config, place.participant_id, seed, row=row, group=group)
    return practice_of(setup.config, place.participant_id, seed, group=group)


def _language_record(request: RunRequest) -> dict[str, object]:
    """What the head of a journal says of the participant's language: nothing where it is English alone."""
    words, one = words_shown(request), request.language
    if words is None:
        return {}
    named = {"code": one.code, "name": one.name, "checked_by": one.checked_by}
    return {"language": {**named, "messages": words[0], "texts": words[1]}}


def _open(place: Place, earlier: EarlierRun, clock: Clock, *, each: bool) -> Journal:
    """The journal to write. What gives way is moved only now, when nothing refuses the new run any more."""
    if earlier.before is not None:
        clock.go_on_after(earlier.before.records[-1].utc)
        return Journal.reopen(earlier.before, clock, each=each)
    if earlier.gives_way:
        give_way(place, earlier, clock)
    folders.make_results(place.folder)
    return Journal.create(place.journal, clock, each=each)


def _circumstances(request: RunRequest, gun: Gun, clock: Clock) -> dict[str, object]:
    """What a journal says of how a run began, or went on; practices and synthetic runs name the preregistration too.

    The experimenter cannot be kept from knowing the direction, as they turn the gun, and dampers, set by hand; nor, as
    the gun is heard, whether there was a stimulus, which the screens do not tell.
    """
    setup = request.setup
    frozen = preregistration.in_force(preregistration.study_folder(request.results, setup.source))
    dampers = [f"method {name}" for name in setup.config.methods if setup.gun.methods[name].damper]
    return {
        "provenance": provenance(),
        "gun": asdict(gun.identify()),
        "clock": clock.name,
        **({"sensor": request.sensor} if request.sensor else {}),
        **{name: True for name, has in request.options.named if has},
        "experimenter_knows": ["direction", *dampers, *by_hand(setup.config), *_seen_in_trials(setup.config)],
        **({"preregistration_sha256": frozen} if frozen else {}),
    }


def _seen_in_trials(design: DesignConfig) -> Iterator[str]:
    """The factors whose levels the experimenter is shown once they were felt, and whether something was."""
    if design.adaptive is not None and design.adaptive.show_level:
        yield from design.adapted
    if design.trial.has_blanks:
        yield "stimulus"


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


def _tell(live: LiveRun, screen: Screen, changes: Iterable[str]) -> None:
    """Say what is not as it was before, all of it at once, and have each on record."""
    if texts := list(changes):
        screen.trouble("\n".join(texts))
    for text in texts:
        live.remark(Noted(trial=None, text=text))


def _halted_before(position: RunPosition, place: Place, before: Contents | None, live: LiveRun) -> RunPosition:
    """Where a run stands; what its participant or gun did before it may owe it a test shot too, which is noted."""
    if position.halted or not begins_halted(place, before, live.gun_name):
        return position
    live.remark(Noted(trial=None, text=HALTED_BEFORE))
    return replace(position, halted=True)


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
        halted = desk.live.halted
        saved = _tables_of_stopped(place, desk.live.journal.read_back(), why, halted=halted)
        if isinstance(stop, RunStopped):
            stop.saved, stop.halted = saved, halted
        raise
    except JournalError as error:
        desk.live.end(str(error))
        desk.live.fail(error)
    desk.live.end("")
    contents = desk.live.journal.read_back()
    hashes = {"table_sha256": hashlib.sha256(table(contents)).hexdigest(), "journal_sha256": contents.sha256}
    desk.live.journal.append("finished", **hashes)
    return _tables_of_finished(place, contents)


def _write_tables(place: Place, contents: Contents) -> int:
    """Write the tables that a journal makes, and their dictionary; the answers in it. `OSError`: they cannot be."""
    storage.write_whole(place.table, table(contents))
    design = began_with(contents.head)
    measured = shots_table(contents)
    if measured is not None:
        storage.write_whole(place.shots, measured)
    storage.write_whole(place.results / f"task-{design.design}_columns.md", design_dictionary(design).encode())
    return replay.answers_in(contents)


def _tables_of_finished(place: Place, contents: Contents) -> int:
    """As `_write_tables`, of a run that is finished. `PlaceError`: they cannot be written, by which nothing is lost."""
    try:
        return _write_tables(place, contents)
    except OSError as error:
        raise PlaceError(f"the run is finished, and {_unwritten(place, error)}") from error


def _tables_of_stopped(place: Place, contents: Contents, why: str, *, halted: bool) -> int:
    """As `_write_tables`, of a run that was stopped. `RunStopped`: they cannot be written, by which nothing is lost."""
    try:
        return _write_tables(place, contents)
    except OSError as error:
        stop = RunStopped(f"{why}; {_unwritten(place, error)}")
        stop.saved, stop.halted = replay.answers_in(contents), halted
        raise stop from error


def _unwritten(place: Place, error: OSError) -> str:
    mend = "free some space" if error.errno in storage.DISK_FULL else "see to that"
    return (
        f"every answer is in the journal, but its table could not be written ({error.filename or place.table}: "
        f"{error.strerror}): {mend}, and `recoil rebuild {place.journal}` writes it"
    )
