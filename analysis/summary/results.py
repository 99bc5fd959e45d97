"""The statistics of a study as typed results; a field is called what it is called in `statistics.json`.

Rates 0 to 1, times in s, SD with n - 1; nothing is rounded. NaN and infinities are written as null and are named in
`warnings`; None stands where a test was not made, and a `reason` beside it says why.
"""

from __future__ import annotations

import html
import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

from analysis.logs.exclusions import LeftOut
from analysis.report import apa
from analysis.report.serial import OPTIONAL, SPREAD, NotebookResult, beside
from analysis.stats.cells import ByParticipant
from analysis.stats.diagnostics import EffectSize, Normality, Sphericity
from analysis.stats.logit_model import Clustering, LogitModel
from analysis.stats.paired import PairedT, SignedRanks
from analysis.summary.deviations import StudyDeviations
from analysis.summary.participation import Participation
from analysis.times.own_trials import ResponseTimes
from analysis.times.speed_accuracy import NoSpeedAccuracy, SpeedAccuracy
from device.messages import how_many
from experiments.design.language import Level, shown_level
from experiments.design.methods_section import level_words
from experiments.record.tables import DataKind

if TYPE_CHECKING:
    from analysis.logs.exclusion_rules import KeptTrials
    from analysis.summary.question_results import QuestionSummary
    from analysis.summary.remarks_coding import CodedRemarks
    from analysis.summary.requests import Requested

STATISTICS_FILE = "statistics.json"


@dataclass(frozen=True, slots=True, kw_only=True)
class ConfidenceInterval:
    """The ends of a confidence interval."""

    ci_low: float
    ci_high: float


@dataclass(frozen=True, slots=True, kw_only=True)
class AnovaTest:
    """The repeated-measures ANOVA of one experiment; `df` of the effect and of the error."""

    F: float
    df: tuple[int, int]
    p: float
    ss_effect: float
    ss_error: float
    ms_error: float
    ss_participants: float
    name: str = "one-way repeated-measures ANOVA"


@dataclass(frozen=True, slots=True, kw_only=True)
class Pair:
    """Tukey's test of two methods: the mean of `a` less that of `b`, with its simultaneous interval."""

    a: str
    b: str
    difference: float
    q: float
    p: float
    ci_low: float
    ci_high: float


@dataclass(frozen=True, slots=True, kw_only=True)
class OwnErrorPair:
    """Tukey's test of two methods with the pair's own error; None without a variance of the differences."""

    a: str
    b: str
    difference: float
    q: float | None = None
    p: float | None = None
    ci_low: float | None = None
    ci_high: float | None = None
    reason: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class NotedEffectSize:
    """Effect sizes, and what their intervals are of."""

    size: EffectSize = field(metadata=beside(EffectSize))
    note: str


@dataclass(frozen=True, slots=True, kw_only=True)
class PostHoc:
    """Signed-rank tests of all pairs, and why these."""

    name: str
    pairs: tuple[SignedRanks, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class FriedmanTest:
    """Friedman's test with the mean rank of each method."""

    chi2: float | None
    df: int | None
    p: float | None
    kendall_w: float | None
    reason: str | None
    mean_ranks: Mapping[str, float]
    post_hoc: PostHoc


@dataclass(frozen=True, slots=True, kw_only=True)
class BayesFactor:
    """A pair's Bayes factor against no difference."""

    a: str
    b: str
    bf10: float | None
    reason: str | None


@dataclass(frozen=True, slots=True, kw_only=True)
class BayesFactors:
    """The Bayes factors of all pairs and the scale `r` of their prior."""

    r: float
    note: str
    pairs: tuple[BayesFactor, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class NotedNormality:
    """The test of the residuals, and how to read it."""

    test: Normality = field(metadata=beside(Normality))
    note: str


@dataclass(frozen=True, slots=True, kw_only=True)
class FarScore:
    """An outlier: whose, with which method, and the fence that it lies beyond."""

    participant: str
    method: str
    score: float
    fence: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Outliers:
    """All outliers by a rule."""

    rule: str
    found: tuple[FarScore, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Diagnostics:
    """Residuals, outliers, and how many participants score at each end of the `scale`, by method."""

    normality: NotedNormality
    outliers: Outliers
    scale: tuple[float, float]
    floor: Mapping[str, int]
    ceiling: Mapping[str, int]


@dataclass(frozen=True, slots=True, kw_only=True)
class Supplement:
    """What a reader asks for beside F and Tukey."""

    sphericity: Sphericity
    effect_size: NotedEffectSize
    friedman: FriedmanTest
    paired_t: tuple[PairedT, ...]
    tukey_paired: tuple[OwnErrorPair, ...]
    tukey_paired_note: str
    bayes_factors: BayesFactors
    diagnostics: Diagnostics


@dataclass(frozen=True, slots=True, kw_only=True)
class Assumption:
    """A sentence, the warning if it does not hold, and whether that changes which number to read (`serious`)."""

    assumption: str
    warning: str | None = None
    serious: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Origin:
    """Whose hand gave how many of the answers, and which guns rendered how many of the trials."""

    answers: Mapping[str, int]
    guns: Mapping[str, int]

    @property
    def synthetic(self) -> bool:
        """Whether nobody of flesh answered."""
        return set(self.answers) == {"synthetic"}


@dataclass(frozen=True, slots=True, kw_only=True)
class WithinStatistics:
    """The scores of `n` complete participants with each method, and the tests on them.

    The tests and the supplement are None for fewer than two participants or methods.
    """

    n: int
    methods: tuple[str, ...]
    means: Mapping[str, float]
    sds: Mapping[str, float]
    participants: ByParticipant
    within_ci: Mapping[str, ConfidenceInterval] | None
    anova: AnovaTest | None
    tukey: tuple[Pair, ...] | None
    tukey_error_term: str
    supplement: Supplement | None = field(metadata=beside(Supplement))
    origin: Origin
    assumptions: tuple[Assumption, ...] = ()

    @property
    def people(self) -> str:
        """How many took part; said so if nobody of flesh answered."""
        return how_many(self.n, "synthetic participant" if self.origin.synthetic else "participant")


@dataclass(frozen=True, slots=True, kw_only=True)
class Scores:
    """Means, SDs and participants' values of a measure by method."""

    means: Mapping[str, float]
    sds: Mapping[str, float]
    participants: ByParticipant


@dataclass(frozen=True, slots=True, kw_only=True)
class PooledBinomial:
    """The exact two-sided binomial test of all participants' answers against guessing; how they cluster in people.

    `fewest_and_most` trials of a participant, where not everybody has as many.
    """

    successes: int
    trials: int
    p: float
    log_p: float
    estimate: float
    ci_low: float
    ci_high: float
    wilson_low: float
    wilson_high: float
    clustering: Clustering
    fewest_and_most: tuple[int, int] | None = field(default=None, metadata=OPTIONAL)


@dataclass(frozen=True, slots=True, kw_only=True)
class NamedModel:
    """The logistic model of the forward answers, its name and what it is."""

    name: str
    note: str
    fit: LogitModel = field(metadata=beside(LogitModel))


@dataclass(frozen=True, slots=True, kw_only=True)
class MeanSd:
    """Over participants."""

    mean: float
    sd: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Sensitivity:
    """d' and criterion, over participants and each one's own."""

    d_prime: MeanSd
    criterion: MeanSd
    participants: ByParticipant


@dataclass(frozen=True, slots=True, kw_only=True)
class MedianTime:
    """The median of `n` response times in s, None of none."""

    median: float | None
    n: int


@dataclass(frozen=True, slots=True, kw_only=True)
class DirectionStatistics(WithinStatistics):
    """Experiment 1; the scores are correct rates on forward shots. `sensitivity` None where a direction is missing."""

    backward: Scores
    binomial: Mapping[str, Mapping[str, PooledBinomial]]
    binomial_note: str
    clustering_note: str
    model: NamedModel
    sensitivity: Mapping[str, Sensitivity | None]
    response_time: Mapping[str, MedianTime]
    response_times: ResponseTimes
    speed_accuracy: SpeedAccuracy | NoSpeedAccuracy | None = field(default=None, metadata=OPTIONAL)


@dataclass(frozen=True, slots=True, kw_only=True)
class DesignSummary:
    """The statistics of a design: as they stand in `statistics.json` under its name.

    `words`: how many texts were said to each question that asks for them; `assumed`: what the design says it assumes;
    `protocol`: the design as a Methods section.
    `labels`: what the levels in each column are called in print, where that is not their code.
    """

    title: str
    n: int
    factors: Mapping[str, tuple[Level, ...]]
    questions: Mapping[str, QuestionSummary]
    origin: Origin
    words: Mapping[str, int] = field(default_factory=dict)
    assumed: tuple[str, ...] = ()
    protocol: tuple[str, ...] = ()
    labels: Mapping[str, Mapping[str, str]] = field(default_factory=dict)

    def label(self, factor: str, level: Level) -> str:
        """What a level of a factor is called in print; a number with its unit, or the name of its factor."""
        return self.labels.get(factor, {}).get(shown_level(level)) or level_words(factor, level)

    def condition(self, levels: Mapping[str, Level], word: Callable[[str], str]) -> str:
        """What a condition is called: its levels by what each is called, as `word` has it on a page or in a figure."""
        return ", ".join(word(self.label(factor, level)) for factor, level in levels.items())


@dataclass(frozen=True, slots=True, kw_only=True)
class RulesApplied:
    """The rules of exclusion that were asked for, and what they dropped: trials by participant and rule."""

    file: str
    config: Mapping[str, Any]
    trials: Mapping[str, KeptTrials]
    dropped: Mapping[str, Mapping[str, Mapping[str, int]]]


@dataclass(frozen=True, slots=True, kw_only=True)
class StudyStatistics(NotebookResult):
    """The statistics of logs; None for an experiment without a log. `studies` of each study, if there are several.

    `designs` by their names, which stand beside the two experiments in the file. All are of one kind of data, which
    `data_kind` names; those of other kinds, if they were asked for, are `kept_apart` in the same form. `labels`: what
    methods are called in print, where that is not their code. `log_remarks`: what there is to say of logs that were
    used, and of files that are no logs.
    """

    direction: DirectionStatistics | None = field(default=None, metadata=OPTIONAL)
    preference: WithinStatistics | None = field(default=None, metadata=OPTIONAL)
    designs: Mapping[str, DesignSummary] = field(default_factory=dict, metadata=SPREAD)
    excluded: tuple[LeftOut, ...] = ()
    log_remarks: tuple[str, ...] | None = field(default=None, metadata=OPTIONAL)
    participation: Participation | None = field(default=None, metadata=OPTIONAL)
    warnings: tuple[str, ...] = ()
    labels: Mapping[str, str] | None = field(default=None, metadata=OPTIONAL)
    versions: Mapping[str, str] | None = field(default=None, metadata=OPTIONAL)
    studies: Mapping[str, StudyStatistics] | None = field(default=None, metadata=OPTIONAL)
    rules: RulesApplied | None = field(default=None, metadata=OPTIONAL)
    remarks: CodedRemarks | None = field(default=None, metadata=OPTIONAL)
    requested: tuple[Requested, ...] | None = field(default=None, metadata=OPTIONAL)
    preregistration: tuple[StudyDeviations, ...] | None = field(default=None, metadata=OPTIONAL)
    data_kind: DataKind = "real"
    kept_apart: Mapping[DataKind, StudyStatistics] | None = field(default=None, metadata=OPTIONAL)

    def of(self, experiment: str) -> WithinStatistics | None:
        """The statistics of an experiment by its name."""
        return {"direction": self.direction, "preference": self.preference}.get(experiment)

    @property
    def analysed(self) -> dict[str, WithinStatistics]:
        """The experiments that have a complete participant, by name."""
        names = ("direction", "preference")
        return {name: found for name in names if (found := self.of(name)) is not None and found.n}

    def rows(self) -> list[dict[str, object]]:
        """A row an experiment and method: participants, mean and SD, and the within-subject interval of the mean.

        Of other designs a row a question and condition, by the levels of the factors, with the interval of a share.
        Where data of several kinds are kept apart, each row names its own.
        """
        if self.kept_apart:
            kinds = {self.data_kind: replace(self, kept_apart=None), **self.kept_apart}
            return [{"data": kind} | row for kind, one in kinds.items() for row in one.rows()]
        return [*self._rows_of_methods(), *(row for name in self.designs for row in self._rows_of_design(name))]

    def _rows_of_methods(self) -> list[dict[str, object]]:
        blank = ConfidenceInterval(ci_low=math.nan, ci_high=math.nan)
        return [
            {"experiment": name, "method": method, "n": found.n, "mean": found.means[method], "sd": found.sds[method]}
            | {"ci_low": ends.ci_low, "ci_high": ends.ci_high}
            for name, found in self.analysed.items()
            for method in found.methods
            for ends in [(found.within_ci or {}).get(method, blank)]
        ]

    def _rows_of_design(self, name: str) -> Iterator[dict[str, object]]:
        for asked, question in self.designs[name].questions.items():
            for cell in question.cells:
                numbers = {"n": cell.people, "mean": cell.mean, "sd": cell.sd}
                numbers |= {"ci_low": cell.ci_low, "ci_high": cell.ci_high}
                known = {key: math.nan if value is None else value for key, value in numbers.items()}
                row: dict[str, object] = {"experiment": name, "question": asked}
                taken = {"data", *row, *known}
                levels = {f"factor_{key}" if key in taken else key: level for key, level in cell.levels.items()}
                yield {**row, **levels, **known}

    def _tests(self) -> Iterator[str]:
        """Each F test, by what it is of."""
        for name, found in self.analysed.items():
            if (anova := found.anova) is not None:
                yield f"{name.capitalize()}: {apa.f_test(anova.F, anova.df, anova.p)}"
        for name, design in self.designs.items():
            for asked, question in design.questions.items():
                tests = (test for test in question.tests if test.name == "anova" and test.reason is None)
                for test in tests:
                    told = apa.f_test(test.statistic, test.df or (), test.p)
                    told += f"; corrected {apa.p_value(test.p_gg)}" if test.p_gg is not None else ""
                    yield f"{name.capitalize()}, {asked}, {test.effect}: {told}"

    def _repr_html_(self) -> str:
        """The table of means with each F test, for a notebook."""
        tests = "".join(f"<p>{html.escape(test)}</p>" for test in self._tests())
        return NotebookResult._repr_html_(self) + tests  # super() fails in a class with slots
