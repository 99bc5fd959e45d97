"""Resume is replay: a journal's outcomes are sent into a fresh session, which then stands where the run broke off."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass, field, replace

from experiments.design.plan import Trial
from experiments.record.journal import Contents, JournalError, Record, read_as
from experiments.session import steps
from experiments.session.history import GrowingHistory, History, asked_before
from experiments.session.remarks import HALTED_BEFORE, OF_HALT, REMARK, EntryCorrected, Noted, Remark, TestShot
from experiments.tasks.questions import AnswerValue


@dataclass(frozen=True, slots=True, kw_only=True)
class RunPosition:
    """Where a run stands: its next step, `None` at the end, and what was done before, which the session reads.

    `halted`: an emergency stop ended it, or what came before it, and no test shot was fired since; one must come before
    anything else.
    """

    step: steps.Step | None
    history: GrowingHistory = field(default_factory=list)
    halted: bool = False


def last_word_on_gun(contents: Contents, gun: str | None = None) -> tuple[str, bool]:
    """When an emergency stop or a test shot after one is on record last, and whether it is the stop; "" if none is.

    The stop is its record, its reason, that a test shot was owed before or, where the disk took none of them, that
    the run stopped by it. Without any, a shot says that none was owed. `gun`: the word on this one alone, by its name.
    """
    last, fired, on = ("", False), "", ""
    for line in contents.records:
        on = on if line.gun is None else line.gun.name
        if gun is not None and on != gun:
            continue
        word = _remark(contents, line) if line.kind == "remark" else None
        owed = isinstance(word, OF_HALT) or (isinstance(word, Noted) and word.text == HALTED_BEFORE)
        if owed or (line.halted):
            last = line.utc, True
        elif isinstance(word, TestShot) and not word.cause:
            last = line.utc, False
        fired = line.utc if is_shot(line) else fired
    return last if last[0] else (fired, False)


def is_shot(line: Record) -> bool:
    """Whether a record says that the gun fired at the participant."""
    said = line.body.get("kind") if line.kind == "outcome" and isinstance(line.body, dict) else line.kind
    return said in ("fired", "presented", "shot")


def history(contents: Contents) -> History:
    """All that a journal tells, in order: the steps that were done, each with its outcome, and remarks between them."""
    found: GrowingHistory = []
    for _ in _read(contents, found):
        pass
    return found


def answers_in(contents: Contents) -> int:
    """How many answers a journal holds."""
    return sum(isinstance(word, steps.Answered) for _, word in history(contents))


_REMARKS = ("remark", "measured")
"""Records that belong to no step: what was said, and what a sensor measured."""


def _read(contents: Contents, found: GrowingHistory) -> Iterator[steps.Step]:
    """The steps of a journal's records, each when it is there; what lies before it is in `found` by then."""
    step: steps.Step | None = None
    shots: list[object] = []
    planned = frozenset(contents.plan.trials)
    for line in contents.records:
        if line.kind == "step":
            step = read_as(steps.STEP, line.body, _place(contents, line))
            _check_trial(contents, line, steps.trial_of(step), planned)
            shots = []
            yield step
        elif line.kind == "shot":
            shots.append(line.body)
        elif line.kind in _REMARKS:
            remark = _remark(contents, line)
            _check_trial(contents, line, getattr(remark, "trial", None), planned)
            if isinstance(remark, EntryCorrected):
                _check_value(contents, line, asked_before(found, remark), remark.value)
            found.append((None, remark))
        elif line.kind == "outcome":
            if step is None:
                raise JournalError("an outcome without its step; a line was lost", at=_place(contents, line))
            found.append((step, _outcome(contents, line, step, shots)))
            step = None


def _outcome(contents: Contents, line: Record, step: steps.Step, train: list[object]) -> steps.Outcome:
    """The outcome of a step; a train at which the gun failed, or the run, was felt as far as its last shot."""
    outcome = read_as(steps.OUTCOME, line.body, _place(contents, line))
    if isinstance(outcome, steps.Answered):
        _check_value(contents, line, step, outcome.value)
    if not train or not isinstance(outcome, steps.Failed | steps.Interrupted) or outcome.exposure_s is not None:
        return outcome
    shots = read_as(steps.TRAIN_SHOTS, train, f"{_place(contents, line)}: the shots before it")
    exposure_s = round(shots[-1].pulse_start_s - shots[0].pulse_start_s, 6)
    return replace(outcome, shots=len(shots), exposure_s=exposure_s)


def _check_trial(contents: Contents, line: Record, trial: Trial | None, planned: Collection[Trial]) -> None:
    """`JournalError` for a step or remark about a trial that nobody planned."""
    if trial is not None and trial not in planned:
        where = f"session {trial.session}, set {trial.set}, trial {trial.trial}"
        raise JournalError(f"{where} is none of the plan in line 1; the record was changed", at=_place(contents, line))


def _check_value(contents: Contents, line: Record, step: steps.Step | None, value: AnswerValue) -> None:
    """`JournalError` for an answer that is none to what was asked."""
    if not isinstance(step, steps.Asking) or not steps.is_answer(step, value):
        kind = steps.what(step) if isinstance(step, steps.Asking) else "answer"
        said = f"value … is no {kind}; the record was changed"
        raise JournalError(said, at=_place(contents, line), value=repr(value))


def outcomes(history: History) -> list[tuple[steps.Step, steps.Outcome]]:
    """The steps that were done, each with its outcome."""
    return [(step, outcome) for step, outcome in history if step and not isinstance(outcome, Remark)]


def replay(session: steps.Session, contents: Contents, told: GrowingHistory | None = None) -> RunPosition:
    """Send a journal's outcomes into a fresh session. `JournalError` if they are not those of this plan.

    `told` is what the session reads, empty yet: it has all that lies before a step in the journal when that is made.
    """
    told = [] if told is None else told
    step, sent = next(session, None), 0
    for number, recorded in enumerate(_read(contents, told), start=1):
        step, sent = _caught_up(session, step, told, sent)
        _compare(contents, number, step, recorded)
    step, _ = _caught_up(session, step, told, sent)
    return RunPosition(step=step, history=told, halted=last_word_on_gun(contents)[1])


def _caught_up(
    session: steps.Session, step: steps.Step | None, told: GrowingHistory, sent: int
) -> tuple[steps.Step | None, int]:
    """The step of a session that was sent the outcomes after so many, and how many those are now."""
    for _, outcome in outcomes(told[sent:]):
        step = steps.step_after(session, outcome)
    return step, len(told)


def go_on(
    session: steps.Session, contents: Contents, position: RunPosition, append: Callable[..., None]
) -> RunPosition:
    """Where a replayed run goes on, at a step that is written through `append`.

    The step that was interrupted is recorded as given up, and its trial is presented again, because its stimulus may
    have been felt.
    """
    step, announced = position.step, _last_step_is_open(contents)
    if step is None:
        return position
    if not announced:
        append("step", body=steps.step_record(step))
    if not (announced or steps.is_begun(step) or isinstance(step, steps.FireShot | steps.Present)):
        return position
    felt = steps.is_begun(step) or (announced and isinstance(step, steps.FireShot | steps.Present))
    outcome = steps.Interrupted(presented=felt)
    append("outcome", body=steps.step_record(outcome))
    position.history.append((step, outcome))
    again = steps.step_after(session, outcome)
    if again is not None:
        append("step", body=steps.step_record(again))
    return replace(position, step=again)


def _last_step_is_open(contents: Contents) -> bool:
    """Whether the last step has no outcome; a stop or a resumption may stand behind it."""
    kinds = [line.kind for line in contents.records if line.kind in ("step", "outcome")]
    return bool(kinds) and kinds[-1] == "step"


def _compare(contents: Contents, number: int, planned: steps.Step | None, recorded: steps.Step) -> None:
    if planned is None or steps.step_record(planned) != steps.step_record(recorded):
        raise JournalError(
            f"{contents.path}: step {number} is {recorded.kind!r} and does not follow from the plan in line 1; "
            "the journal was changed, or another version of Recoil wrote it"
        )


def _remark(contents: Contents, line: Record) -> Remark:
    return read_as(REMARK, line.body, _place(contents, line))


def _place(contents: Contents, line: Record) -> str:
    return f"{contents.path}: line {line.n + 1}"
