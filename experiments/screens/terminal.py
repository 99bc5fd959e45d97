"""The terminal screen: the experimenter reads what to do and types the answers. Nothing but a terminal is needed.

Times come from the experimenter's hand and are logged as such. Neither correctness nor a score is ever shown.
"""

from __future__ import annotations

import io
import queue
import sys
import threading
from contextlib import suppress
from typing import TYPE_CHECKING, TextIO

from experiments.clock import Clock
from experiments.preference.scale import on_scale
from experiments.runner import Desk, RunStopped
from experiments.steps import (
    Answered,
    Ask,
    Describe,
    Described,
    Failed,
    Outcome,
    Prepare,
    Prepared,
    Present,
    Rate,
    Rated,
    Rest,
    Rested,
    Standing,
    Step,
)

if TYPE_CHECKING:
    from device.words import Direction
    from experiments.plan import Plan, Trial

_DIRECTIONS: dict[str, Direction] = {"f": "forward", "forward": "forward", "b": "backward", "backward": "backward"}
_HELP = "type `stop` and Enter at any time to stop; the run can be resumed"


class TerminalScreen:
    """Asks on a terminal and waits for typed lines."""

    shown_s: float | None = None

    def __init__(self, plan: Plan, clock: Clock, lines: TextIO | None = None, out: TextIO | None = None) -> None:
        self._plan = plan
        self._clock = clock
        self._out = out or sys.stdout
        if isinstance(sys.stdin, io.TextIOWrapper):
            sys.stdin.reconfigure(errors="replace")  # a byte that is no UTF-8 is not to end the run
        self._lines: queue.Queue[str | None] = queue.Queue()
        threading.Thread(target=self._read, args=(lines or sys.stdin,), daemon=True).start()
        self._say(f"Participant {plan.participant_id}, experiment {plan.experiment}. {_HELP.capitalize()}.")

    def begin(self, desk: Desk, standing: Standing) -> None:
        """Nothing to take over: every step says all."""

    def prepare(self, step: Prepare) -> Prepared:
        """Say what to tell the participant, where to turn the gun and which damper to set; Enter fires."""
        again = f" (attempt {step.attempt}: the trial is presented again)" if step.attempt > 1 else ""
        damper = f"\n  Set the damper: {step.damper.upper()}." if step.damper else ""
        self._say(f"\n{self._where(step.trial)}{again}{self._told(step)}{damper}")
        self._line(f"  Turn the gun to {step.trial.direction.upper()} and hand it over. Enter fires: ")
        return Prepared()

    def ask(self, step: Ask, onset_s: float) -> Answered:
        """Take f or b; anything else is asked again."""
        prompt = f"  {step.question} f = {step.forward}, b = {step.backward}: "
        while (response := _DIRECTIONS.get(self._line(prompt).lower())) is None:
            self._say("  Not an answer: type f or b and Enter.")
        return Answered(
            response=response,
            response_time_s=round(self._clock.now() - onset_s, 6),
            response_source="experimenter",
            response_time_valid=False,
        )

    def rest(self, step: Rest) -> Rested:
        """Count down; `skip REASON` cuts the break short, and the reason is recorded."""
        start_s = self._clock.now()
        self._say(f"\nBreak between {step.between}: {step.duration_s:g} s. (`skip REASON` ends it early.)")
        reason = self._count_down(start_s + step.duration_s)
        self._say("\aThe break is over.")
        return Rested(rested_s=round(self._clock.now() - start_s, 6), cut_reason=reason)

    def _count_down(self, end_s: float) -> str:
        while (left_s := end_s - self._clock.now()) > 0:
            self._show(f"\r  {left_s:4.0f} s ")
            line = self._poll(min(1.0, left_s))
            if line is not None and line.startswith("skip "):
                return line.removeprefix("skip ").strip()
            if line:
                self._say("  To end the break early type `skip` and the reason.")
        return ""

    def said_next(self, step: Present, onset_s: float, until_s: float) -> bool:
        """Enter means that the participant said next."""
        del step, onset_s
        return (
            self._poll(max(0.0, until_s - self._clock.now()), "\r  Enter when the participant says next: ") is not None
        )

    def rate(self, step: Rate) -> Rated:
        """Take a number on the scale; `none` if the participant gives none. 0 is a rating."""
        self._say(f"\n{self._ordinal(step.trial)}. {step.question}")
        ends = f"{step.minimum:g} = {step.minimum_text}, {step.maximum:g} = {step.maximum_text}"
        while True:
            typed = self._line(f"  {ends}; `none` for no answer: ").lower().replace(",", ".")
            if typed == "none":
                return Rated(rating=None, rating_by="experimenter")
            rating = _number(typed)
            if rating is not None and step.minimum <= rating <= step.maximum:
                kept = on_scale(rating, step.minimum, step.maximum, step.grain)
                return Rated(rating=kept, rating_by="experimenter")
            self._say(f"  Not a rating: type a number from {step.minimum:g} to {step.maximum:g}.")

    def describe(self, step: Describe) -> Described:
        """Take a line of the participant's own words."""
        return Described(comment=self._line(f"  {self._ordinal(step.trial)}. {step.question} "))

    def acknowledge(self, step: Step, outcome: Outcome) -> None:
        """Say that an answer is safe; say what the gun failed at."""
        if isinstance(outcome, Failed):
            self._say(f"  The gun failed: {outcome.cause}\n  The trial is marked and presented again.")
        elif isinstance(step, Ask | Rate | Describe):
            self._say("  Saved.")
        elif isinstance(step, Present):
            self._say("  Presented and saved.")

    def _where(self, trial: Trial) -> str:
        in_session = [other for other in self._plan.trials if other.session == trial.session]
        sets, sessions = in_session[-1].set, self._plan.trials[-1].session
        place = f"Trial {trial.trial} of {len(in_session)}"
        return f"{place}, set {trial.set} of {sets}, session {trial.session} of {sessions}."

    def _told(self, step: Prepare) -> str:
        """The instruction: to be read out before a set, and as a reminder at its other trials."""
        if not step.instruction:
            return ""
        how = "READ OUT" if self._plan.opens_set(step.trial) else "Instruction of this set"
        return f"\n  {how}: {step.instruction}"

    def _ordinal(self, trial: Trial) -> str:
        return f"Feedback {trial.trial} of {len(self._plan.trials)}, in order of presentation"

    def _say(self, text: str) -> None:
        self._show(f"{text}\n")

    def _show(self, text: str) -> None:
        try:
            self._out.write(text)
            self._out.flush()
        except OSError as error:
            raise RunStopped("the terminal was closed") from error

    def _line(self, prompt: str) -> str:
        line = self._poll(None, prompt)
        return line or ""

    def _poll(self, timeout_s: float | None, prompt: str = "") -> str | None:
        """The next typed line, or `None` after the time. `RunStopped` on `stop` or a closed terminal."""
        self._show(prompt)
        try:
            line = self._lines.get(timeout=timeout_s)
        except queue.Empty:
            return None
        if line is None:
            raise RunStopped("the terminal was closed")
        if line == "stop" or line.startswith("stop "):
            raise RunStopped(line.removeprefix("stop").strip() or "stopped by the experimenter")
        return line

    def _read(self, lines: TextIO) -> None:
        with suppress(OSError):  # a terminal that vanishes ends like one that is closed
            for line in lines:
                self._lines.put(line.strip())
        self._lines.put(None)


def _number(typed: str) -> float | None:
    try:
        return float(typed)
    except ValueError:
        return None
