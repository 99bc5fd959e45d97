"""What one question of a design gave, by condition, and what differs, as typed results."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from analysis.report.serial import OPTIONAL, UNWRITTEN
from analysis.summary.pairs import PairedComparison
from analysis.summary.thresholds import Thresholds
from analysis.times.speed_accuracy import NoSpeedAccuracy, SpeedAccuracy
from experiments.design.language import Level


@dataclass(frozen=True, slots=True, kw_only=True)
class ConditionSummary:
    """One condition. `mean` and `sd` over people (n - 1); of scored answers the count right with its exact interval.

    `p`: against chance, if there is one.

    `mean` of numbers is geometric, `sd` then that of their natural logarithms. `catch`: whether these are the catch
    trials, of which right answers are correct rejections, as those of the others are hits; without any, `None`.
    """

    levels: Mapping[str, Level]
    people: int
    trials: int
    mean: float | None
    sd: float | None
    right: int | None = None
    p: float | None = None
    ci_low: float | None = None
    ci_high: float | None = None
    answers: Mapping[str, int] | None = field(default=None, metadata=OPTIONAL)
    catch: bool | None = field(default=None, metadata=OPTIONAL)


@dataclass(frozen=True, slots=True, kw_only=True)
class DesignTest:
    """A test or an estimate. `statistic` is what `name` says; `None` with a `reason` where it could not be made.

    `p_gg`: of an ANOVA of more than two levels within people, corrected by `epsilon` (Greenhouse and Geisser). `n` and
    `kendall_w`: of Friedman's test, of how many people it is, and how much they agree, 0 to 1; `n` of a mean d′: of how
    many who had catch trials there, if somebody had none.
    """

    name: str
    effect: str
    statistic: float | None = None
    df: tuple[int, ...] | None = None
    p: float | None = None
    size: float | None = None
    ci_low: float | None = None
    ci_high: float | None = None
    epsilon: float | None = field(default=None, metadata=OPTIONAL)
    p_gg: float | None = field(default=None, metadata=OPTIONAL)
    n: int | None = field(default=None, metadata=OPTIONAL)
    kendall_w: float | None = field(default=None, metadata=OPTIONAL)
    reason: str | None = None


def _of_errors(cell: ConditionSummary) -> ConditionSummary:
    """A condition of scored answers with those that are wrong in the place of the right ones."""
    if cell.right is None or cell.ci_low is None or cell.ci_high is None:
        return cell
    return replace(cell, right=cell.trials - cell.right, ci_low=1.0 - cell.ci_high, ci_high=1.0 - cell.ci_low)


@dataclass(frozen=True, slots=True, kw_only=True)
class QuestionSummary:
    """All that one question gave. `left_out`: who has no score in some condition, and so is in no test.

    `chance`: how often who does not know is right; `None` where nothing is right, or stimuli were to be detected.
    `preferred`: of pairs, how often each level was chosen of all trials that had it, a tie as half, in the mean over
    people. `scale`: the ends of a rating, with their words, or what rank 1 means. `thresholds`: the psychometric
    functions over a numeric factor, where an answer can be a success. `pairs`: scores of compared pairs.
    `speed_accuracy`: of a question with two answers of which one is right; its `methods` are the conditions.
    `held`: its share of successes is where a procedure held it, which chose the levels by the answers. `not_above_0`:
    how many numbers have no logarithm, and so stand in no mean; `None` without any. `called`: what answers are called
    where that is not their code.
    """

    kind: str
    cells: tuple[ConditionSummary, ...]
    tests: tuple[DesignTest, ...]
    left_out: tuple[str, ...] = ()
    chance: float | None = None
    preferred: tuple[ConditionSummary, ...] | None = field(default=None, metadata=OPTIONAL)
    scale: str | None = field(default=None, metadata=OPTIONAL)
    thresholds: Thresholds | None = field(default=None, metadata=OPTIONAL)
    pairs: PairedComparison | None = field(default=None, metadata=OPTIONAL)
    speed_accuracy: SpeedAccuracy | NoSpeedAccuracy | None = field(default=None, metadata=OPTIONAL)
    held: bool = field(default=False, metadata=UNWRITTEN)
    not_above_0: int | None = field(default=None, metadata=OPTIONAL)
    called: Mapping[str, str] = field(default_factory=dict, metadata=UNWRITTEN)

    def label(self, answer: str) -> str:
        """What an answer was called."""
        return self.called.get(answer, answer)

    @property
    def pictured(self) -> tuple[ConditionSummary, ...]:
        """The conditions of its picture: of pairs each item, and no catch trials beside others."""
        cells = self.preferred or self.cells
        return tuple(cell for cell in cells if not cell.catch) or cells

    @property
    def false_alarms(self) -> tuple[ConditionSummary, ...]:
        """The catch trials beside others: `right` is how often a stimulus was said to be there."""
        caught = [cell for cell in self.cells if cell.catch] if self.detected else []
        return tuple(_of_errors(cell) for cell in caught if len(caught) < len(self.cells))

    @property
    def detected(self) -> bool:
        """Whether stimuli were told from catch trials: right answers are hits, and there correct rejections."""
        return self.chance is None and any(cell.right is not None for cell in self.cells)

    @property
    def counted(self) -> str | None:
        """The answer whose share is told of each condition: the first, where none is right."""
        shares = self.kind in ("choice", "yes-no") and self.preferred is None
        answers = tuple(self.cells[0].answers or ()) if self.cells and self.cells[0].right is None else ()
        return answers[0] if shares and answers else None

    @property
    def cut_at_ends(self) -> bool:
        """Whether an SD of shares reaches beyond 0 or 100 %, where the whiskers of its picture end."""
        shares = [one for one in self.pictured if one.right is None and self.kind in ("choice", "yes-no")]
        return any(one.mean is not None and (one.sd or 0.0) > min(one.mean, 1 - one.mean) for one in shares)

    @property
    def compared(self) -> bool:
        """Whether any two conditions were tested against each other."""
        return any(test.name == "tukey" for test in self.tests)

    @property
    def lacked(self) -> str:
        """What somebody lacked in a condition who is in no test."""
        return "number above 0" if self.kind == "number" else "answer"

    @property
    def drawn(self) -> bool:
        """Whether what its conditions gave is worth a picture."""
        return bool(self.cells) and not self.held
