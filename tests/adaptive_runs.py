"""Adaptive runs with corrections and repeats at random moments, and what their next levels must be, told plainly."""

from __future__ import annotations

import json
import random
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

from device import open_gun
from experiments.clock import Clock, VirtualClock
from experiments.config.setup import Setup
from experiments.design.config import DesignConfig
from experiments.design.language import Levels
from experiments.design.plan import Plan, Trial
from experiments.design.procedures.choosing import AdaptiveTrack, ChosenLevels, paired_track, tracks_of_cell
from experiments.design.procedures.config import PairingConfig
from experiments.design.stimuli import stimuli_of
from experiments.design.streams import Stream
from experiments.live_run import LiveRun
from experiments.record import storage
from experiments.record.design_table import design_rows
from experiments.record.journal import Contents, Journal, contents_of, read_journal
from experiments.record.replay import RunPosition, replay
from experiments.record.replay import history as told_by
from experiments.run import run
from experiments.run_request import RunRequest
from experiments.runner import Desk, carry_out
from experiments.screens.synthetic import SyntheticScreen, synthetic_screen
from experiments.session import events
from experiments.session.design_session import design_session
from experiments.session.history import GrowingHistory, History
from experiments.session.remarks import EntryCorrected, Remark
from experiments.session.states import Position, State
from experiments.session.steps import (
    STEP,
    Answered,
    Ask,
    Failed,
    Fired,
    FireShot,
    Interrupted,
    Outcome,
    Repeated,
    Step,
    step_record,
)
from experiments.study.folders import place
from experiments.synthetic.answers import SyntheticParticipant, synthetic_participant_of
from experiments.synthetic.laws import SyntheticAnswers
from experiments.tasks.questions import AnswerValue
from tests.designs import changed, merged

_EVEN = {"maximum": 18.0, "minimum": 6.0}
_GRIDS = {
    "threshold": {"points": 9, **_EVEN},
    "width": {"points": 3, "minimum": 2.0, "maximum": 12.0},
    "lapse": {"points": 2, "minimum": 0.0, "maximum": 0.04},
}
_TRACKS = {
    "posterior": {"tracks": 2, "trials": 8, **_GRIDS},
    "posterior-ends": {"tracks": 2, "trials": 10, "credible_width": 5.0, "least_trials": 3, **_GRIDS},
    "up-down": {
        "kind": "up-down",
        "trials": 12,
        "reversals": 3,
        "down": 2,
        "starts": [16.0, 10.0],
        "steps": [2.0, 1.0],
    },
    "kesten": {
        "kind": "kesten",
        "trials": 9,
        "target": 0.75,
        "starts": [16.0, 10.0],
        "first_step": 8.0,
        "reversals": 4,
    },
}
_PAIRING = {"kind": "pairing", "of": ["method"], "trials": 14}
KINDS = (*_TRACKS, "pairing")


def adaptive(kind: str, sets: int = 2, **more: Any) -> Setup[DesignConfig]:
    """The shipped threshold with short tracks of a kind, in a few sets; or the shipped pairs with one of pairs."""
    setup = changed("pairs" if kind == "pairing" else "threshold")
    tables = setup.config.model_dump(mode="json") | {"order": {"sets": sets}} | more
    if kind == "pairing":
        tables["procedure"] = _PAIRING
        tables["questions"]["rather"] |= {"answers": ["first", "second", "neither"], "keys": {}}
    else:
        tables["procedure"] = {"kind": "posterior", "of": ["voltage_V"], "mixed": ["direction"]} | _TRACKS[kind]
        tables["factors"]["voltage_V"]["levels"] = {"grain": 1.0, **_EVEN}
    sure = {"kind": "rating", "text": "How sure?", "minimum": 0.0, "maximum": 4.0, "grain": 1.0}
    tables["questions"]["sure"] = sure  # a trial that breaks off here was answered, and is presented again
    assert setup.laws is not None
    given = setup.laws.model_dump()
    if kind == "pairing":
        given["questions"]["rather"] = {
            "law": "shares",
            "share": {"all": {"first": 0.5, "second": 0.3, "neither": 0.2}},
        }
    laws = merged(given, {"questions": {"sure": {"law": "ratings", "mean": {"all": 2.0}}}})
    config = DesignConfig.model_validate(tables, strict=False)
    return replace(setup, config=config, laws=SyntheticAnswers.model_validate(laws))


class UndoingScreen(SyntheticScreen):
    """A synthetic participant whose experimenter corrects and repeats at random, wherever that may be done."""

    def __init__(self, config: Any, participant: SyntheticParticipant, clock: Clock, seed: int, share: float) -> None:
        super().__init__(config, participant, clock)
        self._random, self._share = random.Random(seed), share

    def act(self, position: Position, until_s: float | None) -> None:
        open_for = (State.PREPARING, State.SETTING, State.ASKING, State.RATING, State.RESTING, State.CLOSING)
        if position.state in open_for and self._live is not None and self._random.random() < self._share:
            self._meddle()
            position = self._live.position
        if position.state is not State.SAVING:
            super().act(position, until_s)

    def _meddle(self) -> None:
        live, draw = self._live, self._random
        assert live is not None
        if draw.random() < 0.2 and live.offer(events.Repeat(reason="spoiled")):
            return
        for _ in range(draw.randint(1, 5)):
            live.offer(events.Undo())
        if isinstance(asked := live.position.correcting, Ask):
            live.offer(events.Correct(value=draw.choice([one.answer for one in asked.choices])))
        if live.position.state is State.CORRECTING:
            live.offer(events.Leave())


def cut_and_resumed(setup: Setup[DesignConfig], contents: Contents, at: int, folder: Path) -> Contents:
    """The journal of a run that was cut off there, and went on without a correction."""
    where = place(folder, "P01", setup.config.design)
    storage.make_folder(where.folder)
    where.journal.write_bytes(contents.path.read_bytes()[:at])
    request = RunRequest(setup=setup, participant_id="P01", results=folder, again="resume")
    return read_journal(run(request, synthetic_screen, VirtualClock()).place.journal)


def undone_run(setup: Setup[DesignConfig], plan: Plan, folder: Path, seed: int, share: float) -> Contents:
    """The journal of a whole run of a plan, with so many corrections and repeats."""
    clock, path = VirtualClock(), folder / f"sub-P01_task-{plan.experiment}-{seed}_journal.jsonl"
    told: GrowingHistory = []
    storage.make_folder(folder)
    with Journal.create(path, clock) as journal:
        heads = {"plan": plan.record(), "plan_sha256": plan.sha256()}
        journal.append("run", **heads, setup=setup.record(), setup_sha256=setup.sha256())
        going, stimuli = design_session(plan, setup, told), stimuli_of(setup.config, setup.gun)
        gun = open_gun("simulated", stimuli.methods, clock=clock.now)
        screen = UndoingScreen(setup.config, synthetic_participant_of(setup, plan), clock, seed, share)
        live = LiveRun(plan=plan, gun=gun, journal=journal, clock=clock, screen=screen, guard_s=0.0, told=told)
        first = next(going)
        journal.append("step", body=step_record(first))
        screen.begin(live)
        carry_out(going, Desk(live=live, stimuli=stimuli), RunPosition(step=first))
    return read_journal(path)


def counted(history: History, plan: Plan, number: int) -> list[tuple[Levels, float]]:
    """The answers of a track that count, in order: to which levels, and whether right, or the first of a pair."""
    found: list[tuple[int, Levels, float]] = []
    for trial in (one for one in plan.trials if one.track == number):
        answer = _that_counts(history, trial)
        if answer is not None:
            place, felt, said = answer
            found.append((place, felt, _OF_PAIR[str(said)] if said in _OF_PAIR else float(said == trial.direction)))
    return [(felt, success) for _, felt, success in sorted(found)]


_OF_PAIR = {"first": 1.0, "second": 0.0, "neither": 0.5}


def _that_counts(history: History, trial: Trial) -> tuple[int, Levels, AnswerValue] | None:
    """Where the answer to a trial stands, to what it was given, and what it says: of none that was presented again."""
    last = max((at for at, (step, word) in enumerate(history) if _presents_again(step, word, trial)), default=-1)
    own = [(at, step, word) for at, (step, word) in enumerate(history) if at > last and _about(step, word) == trial]
    said = [(at, word.value) for at, step, word in own if _asked(step, word) in ("response", "rather")]
    given = [at for at, step, word in own if isinstance(step, Ask)]
    if not given:
        return None
    (chosen,) = {step.chosen for _, step, _ in own if isinstance(step, FireShot)}
    return given[0], tuple(level for _, level in chosen), said[-1][1]


def _about(step: Step | None, word: Outcome | Remark) -> Trial | None:
    return getattr(word if step is None else step, "trial", None)


def _asked(step: Step | None, word: Outcome | Remark) -> str:
    return word.question if isinstance(word, EntryCorrected) else getattr(step, "question", "")


def _presents_again(step: Step | None, word: Outcome | Remark, trial: Trial) -> bool:
    if isinstance(word, Repeated):
        return word.trial == trial
    return isinstance(word, Failed | Interrupted) and _about(step, word) == trial


def expected(setup: Setup[DesignConfig], plan: Plan, history: History, number: int) -> ChosenLevels | None:
    """The levels that come next in a track: of one that begins anew, and is given its answers at once."""
    track = _begun(setup, plan, number)
    for felt, success in counted(history, plan, number):
        track = track.after(felt, success=success)
    return None if track.over else track.choice()


def _begun(setup: Setup[DesignConfig], plan: Plan, number: int) -> AdaptiveTrack:
    table = setup.config.adaptive
    assert table is not None
    levels = setup.config.factors[table.of[0]].all_levels
    if isinstance(table, PairingConfig):
        stream = Stream(plan.seed, "pairs", plan.experiment, plan.participant_id, str(number))
        return paired_track(table, levels, stream)
    return tracks_of_cell(table, [tuple(map(float, levels))], 0.5)[number - 1]


def check_levels(setup: Setup[DesignConfig], contents: Contents) -> int:
    """Every level of a journal is what its answers so far call for, as they counted then; how many there are."""
    plan, checked = contents.plan, 0
    for step, told in steps_with_history(contents):
        choice = expected(setup, plan, told, step.trial.track)
        assert choice is not None
        assert (tuple(level for _, level in step.chosen), step.at_edge) == (choice.levels, choice.at_edge)
        checked += 1
    return checked


def check_ends(setup: Setup[DesignConfig], contents: Contents) -> None:
    """A run ends when every track is over, by its answers as they count in the end."""
    told = told_by(contents)
    for number in {trial.track for trial in contents.plan.trials}:
        assert expected(setup, contents.plan, told, number) is None


def check_rows(setup: Setup[DesignConfig], contents: Contents) -> int:
    """Whenever a run stops, each row has the answers to the stimulus that it tells of, and no others; how many."""
    checked, plan, design = 0, contents.plan, setup.config
    for at, line in enumerate(contents.records):
        if line.kind not in ("outcome", "remark"):
            continue
        told = told_by(replace(contents, records=contents.records[: at + 1]))
        for trial, row in zip(plan.trials, design_rows(plan, told, design), strict=True):
            assert row.get("onset_utc") == _onset_of_the_last(told, trial)
            for question in design.questions:
                said = _said_of_the_last(told, trial, question)
                assert row.get(question) == (said[0] if said else None)
                checked += said is not None
    return checked


def _onset_of_the_last(history: History, trial: Trial) -> str | None:
    """When the first pulse of the last presentation of a trial was felt."""
    first = [(step, word) for step, word in history if isinstance(step, FireShot) and step.interval == 0]
    felt = [word.onset_utc for step, word in first if step.trial == trial and isinstance(word, Fired)]
    return felt[-1] if felt else None


def _said_of_the_last(history: History, trial: Trial, question: str) -> tuple[AnswerValue] | None:
    """What was said of the last stimulus of a trial that may have been felt, unless it was spoiled."""
    own = [(step, word) for step, word in history if trial in (_about(step, word), getattr(word, "trial", None))]
    last = max((at for at, (step, word) in enumerate(own) if _begins_anew(step, word, trial)), default=-1)
    said = [word for step, word in own[last + 1 :] if _asked(step, word) == question]
    values = [(word.value,) for word in said if isinstance(word, Answered | EntryCorrected)]
    return values[-1] if values else None


def _begins_anew(step: Step | None, word: Outcome | Remark, trial: Trial) -> bool:
    if isinstance(word, Repeated):
        return word.trial == trial
    if isinstance(word, Failed | Interrupted):
        return _about(step, word) == trial
    return isinstance(step, FireShot) and step.trial == trial and step.interval == 0


def steps_with_history(contents: Contents) -> Iterator[tuple[FireShot, History]]:
    """Each shot that was announced, with all that lies before it in the journal."""
    for at, line in enumerate(contents.records):
        if line.kind == "step" and '"fire"' in json.dumps(line.body):
            step = STEP.validate_python(line.body)
            assert isinstance(step, FireShot)
            yield step, told_by(replace(contents, records=contents.records[:at]))


def step_after_cut(setup: Setup[DesignConfig], contents: Contents, data: bytes) -> Step | None:
    """Where a run stands of which the journal has so many bytes."""
    told: GrowingHistory = []
    cut = contents_of(contents.path, data)
    assert cut is not None
    return replay(design_session(cut.plan, setup, told), cut, told).step


def step_after_that(contents: Contents, whole: int) -> Step | None:
    """The step at which the unbroken run stood after so many records: the last one if it was not done, else the next.

    `None`, too, where a correction comes before the next one: the run that was cut off never heard of it.
    """
    kinds = [line.kind for line in contents.records[:whole] if line.kind in ("step", "outcome")]
    if kinds and kinds[-1] == "step":
        return STEP.validate_python([line for line in contents.records[:whole] if line.kind == "step"][-1].body)
    for line in contents.records[whole:]:
        if line.kind == "step":
            return STEP.validate_python(line.body)
        if line.kind == "remark" and '"corrected"' in json.dumps(line.body):
            return None
    return None
