"""The steps of any design: what is told, trials with intervals and questions, breaks, questions about a block."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

from experiments.catalogues.messages import ENGLISH_MESSAGES, ParticipantMessages
from experiments.config.setup import Setup
from experiments.design.config import DesignConfig
from experiments.design.language import INSTRUCTION_FACTOR, TRAIN_INTERVAL, QuestionConfig
from experiments.design.plan import Plan, Trial
from experiments.design.stimuli import settings
from experiments.session.history import History, entered_value, of_one_set
from experiments.session.practice_rounds import is_needed
from experiments.session.steps import (
    Answered,
    Ask,
    Asking,
    Describe,
    FireShot,
    Inform,
    Interrupted,
    Prepare,
    Present,
    Presenter,
    Rate,
    Rest,
    Session,
)
from experiments.session.tracks import adaptive_tracks
from experiments.tasks.questions import AnswerValue, choices, correct_columns, right_answer


def design_session(
    plan: Plan,
    setup: Setup[DesignConfig],
    told: History = (),
    messages: ParticipantMessages = ENGLISH_MESSAGES,
) -> Session:
    """The steps of a run of a design, from what is told first to its end. Of that a practice begins with consent alone.

    `told` is what was done so far, and grows: levels that follow from the answers so far are chosen by it. `messages`
    are in the participant's language, as the texts of the setup's design are.
    """
    script = _Script(setup, plan, told, messages)
    presenter = Presenter(script.presentation)
    for opening in setup.config.opening:
        if opening.kind == "consent" or not plan.practice:  # nothing is fired at anybody before they have agreed
            yield from presenter.until_done(Inform(text=opening.text, what=opening.kind))
    before: Trial | None = None
    block: Trial | None = None
    passed: list[Trial] = []
    for trial in plan.trials:
        if before is not None and not of_one_set(before, trial) and script.due(trial):
            yield from _block_over(presenter, script, block, passed)
            yield from _rest(presenter, script.design, before, trial)
            yield from _left_over(presenter, script, passed)
            passed, block = [], None  # by a correction in the break nothing may follow in this set
        passed.append(trial)
        if (here := script.due(trial)) is not None:
            yield from presenter.present(here)
            before = block = here
    yield from _block_over(presenter, script, block, passed)
    yield from presenter.close()
    while script.left(passed):  # by a correction at the end a track is not over
        yield from _left_over(presenter, script, passed)
        yield from presenter.close()


def _left_over(presenter: Presenter, script: _Script, passed: Sequence[Trial]) -> Session:
    """The trials that a track needs by the answers as they count now, though their places were passed."""
    while (trial := script.left(passed)) is not None:
        yield from presenter.present(trial)


def _block_over(presenter: Presenter, script: _Script, last: Trial | None, passed: Sequence[Trial]) -> Session:
    """The trials that are left, and what is asked about each of a set, in order of presentation, once all were felt.

    `last`: a trial of that set; `None` if nothing was felt since a block was asked about.
    """
    yield from _left_over(presenter, script, passed)
    for trial in script.plan.set_of(last) if last is not None else ():
        for step in script.questions(trial, when="block"):
            yield from presenter.until_done(step)


def _rest(presenter: Presenter, design: DesignConfig, before: Trial, trial: Trial) -> Session:
    breaks = design.breaks
    if trial.session != before.session and breaks.between_sessions_s:
        yield from presenter.until_done(Rest(between="sessions", duration_s=breaks.between_sessions_s))
    elif trial.session == before.session and breaks.between_sets_s:
        yield from presenter.until_done(Rest(between="sets", duration_s=breaks.between_sets_s))


class _Script:
    """What the steps of a design's trials are, all of them made before the first but for levels that are chosen."""

    def __init__(self, setup: Setup[DesignConfig], plan: Plan, told: History, messages: ParticipantMessages) -> None:
        design = setup.config
        self.design, self.gun, self.plan, self._told, self._messages = design, setup.gun, plan, told, messages
        self._stimuli = {trial: tuple(self._intervals(trial)) for trial in plan.trials}
        self._asked = {
            (trial, when): tuple(self._questions(trial, when)) for trial in plan.trials for when in ("trial", "block")
        }
        scored = next(iter(correct_columns(design.questions)), "")
        feedback = design.practice.feedback if plan.practice else design.trial.feedback
        self._scored = scored if feedback else ""
        self._tracks = adaptive_tracks(design, plan, told)
        self._shown = design.adaptive is not None and design.adaptive.show_level
        self._of_track = _by_track(plan)

    def due(self, trial: Trial) -> Trial | None:
        """The trial that a place of the plan is for: of a track the next one in the set; `None` if that is over.

        `None`, too, of a practice's round that is not needed.
        """
        if self.plan.practice and not is_needed(self.design, self.plan, self._told, trial.set):
            return None
        if self._tracks is None or not trial.track:
            return trial
        if self._tracks.is_over(trial.track):
            return None
        own = self._of_track[trial.session, trial.set, trial.track]
        return next((one for one in own if not self._tracks.has_answer(one)), None)

    def left(self, passed: Sequence[Trial]) -> Trial | None:
        """A trial whose track is not over, though all of its places were passed."""
        if self._tracks is None:
            return None
        tracks = dict.fromkeys((one.session, one.set, one.track) for one in passed if one.track)
        return next((trial for one in tracks if (trial := self.due(self._of_track[one][0])) is not None), None)

    def presentation(self, trial: Trial, attempt: int) -> Session:
        """Every interval, with a hand-over where hands have something to do, then the questions and what is told.

        Levels that are chosen are so just before they are felt first; if the track is over by then, nothing is felt.
        """
        tracks, chosen = (self._tracks if trial.track else None), None
        if tracks is not None and tracks.is_over(trial.track):
            return
        for step in self._stimuli[trial]:
            if tracks is None or isinstance(step, Prepare):
                yield replace(step, attempt=attempt)
                continue
            chosen = chosen or tracks.choice(trial.track)
            if chosen is None:
                return
            levels = tracks.condition(chosen)
            yield replace(step, attempt=attempt, chosen=levels, at_edge=chosen.at_edge, shown=self._shown)
        yield from self._judged(trial)

    def _judged(self, trial: Trial) -> Session:
        """What is asked about a trial at once, and whether that was right, as often as it is not told to the end."""
        given: tuple[Asking, AnswerValue] | None = None
        for asked in self.questions(trial, when="trial"):
            outcome = yield asked
            if asked.question == self._scored and isinstance(outcome, Answered):
                given = asked, outcome.value
        while given and (told := self._feedback(*given)) is not None:
            if not isinstance((yield told), Interrupted):
                return

    def questions(self, trial: Trial, *, when: str) -> tuple[Asking, ...]:
        """What is asked about a trial at once, or after its block."""
        return self._asked[trial, when]

    def _feedback(self, asked: Asking, given: AnswerValue) -> Inform | None:
        """Whether the first scored answer is right, as it counts now; `None` where nothing is right or wrong."""
        felt = self._tracks.as_felt(asked.trial) if self._tracks is not None else asked.trial
        right = right_answer(self.design, self.design.questions[asked.question], felt)
        if right is None:
            return None
        said = entered_value(self._told, asked) if self._told else given
        text = self._messages.right if said == right else self._messages.wrong
        return Inform(text=text, what="feedback", trial=asked.trial)

    def _intervals(self, trial: Trial) -> Iterator[Prepare | FireShot | Present]:
        last: object = None
        for interval in range(max(1, len(trial.intervals))):
            by_hand = self._by_hand(trial, interval)
            handed_over = interval == 0 or by_hand not in (None, last)
            if handed_over:
                yield Prepare(
                    trial=trial,
                    attempt=1,
                    settings=self._settings(trial, interval),
                    instruction=self._instruction(trial),
                    interval=interval,
                )
            yield self._stimulus(trial, interval, 0.0 if handed_over else self.design.trial.gap_s)
            if handed_over:
                last = self._held(trial, interval)

    def _by_hand(self, trial: Trial, interval: int) -> object:
        """What hands do for an interval; `None` where nothing is felt, and so nothing is to be done."""
        levels = trial.levels_at(interval)
        return None if levels is None else (trial.direction_at(interval), settings(self.design, self.gun, levels))

    def _held(self, trial: Trial, interval: int) -> object:
        """What hands do before an interval; before an empty one as for one that is not, which it must not give away."""
        done = (self._by_hand(trial, place) for place in (interval, *range(len(trial.intervals))))
        return next((by_hand for by_hand in done if by_hand is not None), None)

    def _settings(self, trial: Trial, interval: int) -> tuple[tuple[str, str], ...]:
        """What is set by hand: of an empty interval, as for one that is not; of a catch trial what does not vary."""
        held = (trial.levels_at(place) for place in (interval, *range(len(trial.intervals))))
        levels = next((levels for levels in held if levels is not None), trial.levels)
        return settings(self.design, self.gun, levels)

    def _instruction(self, trial: Trial) -> str:
        return self.design.factors[INSTRUCTION_FACTOR].texts[trial.instruction] if trial.instruction else ""

    def _stimulus(self, trial: Trial, interval: int, gap_s: float) -> FireShot | Present:
        kind = self.design.trial
        if kind.kind != "train":
            return FireShot(trial=trial, attempt=1, interval=interval, gap_s=gap_s)
        every_s = trial.level(TRAIN_INTERVAL)
        return Present(
            trial=trial,
            attempt=1,
            repeat_every_s=every_s if isinstance(every_s, float) else kind.repeat_every_s,
            max_shots=kind.max_shots,
            least_exposure_s=kind.least_exposure_s,
        )

    def _questions(self, trial: Trial, when: str) -> Iterator[Asking]:
        for name, question in self.design.questions.items():
            if question.when == when:
                yield self._question(name, question, trial)

    def _question(self, name: str, question: QuestionConfig, trial: Trial) -> Asking:
        later = question.when == "block"
        match question.kind:
            case "choice" | "yes-no":
                return Ask(trial=trial, question=name, text=question.text, choices=choices(question), later=later)
            case "text":
                return Describe(trial=trial, question=name, text=question.text, later=later)
            case "ranking":
                return replace(
                    _rate(name, question, trial, (1.0, float(len(self.plan.set_of(trial))), 1.0)), distinct=True
                )
            case _:
                return _rate(name, question, trial, question.scale)


def _by_track(plan: Plan) -> dict[tuple[int, int, int], list[Trial]]:
    """The trials of each track in each set."""
    found: dict[tuple[int, int, int], list[Trial]] = {}
    for trial in plan.trials:
        found.setdefault((trial.session, trial.set, trial.track), []).append(trial)
    return found


def _rate(name: str, question: QuestionConfig, trial: Trial, scale: tuple[float, float, float]) -> Rate:
    minimum, maximum, grain = scale
    return Rate(
        trial=trial,
        question=name,
        text=question.text,
        minimum=minimum,
        maximum=maximum,
        minimum_text=question.minimum_text or "",
        maximum_text=question.maximum_text or "",
        grain=grain,
        later=question.when == "block",
        may_be_skipped=question.may_be_skipped,
        is_number=question.kind == "number",
    )
