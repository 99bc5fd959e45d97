"""The claims of a paper's file: where it says what, and which check it calls with what arguments.

A number that is rounded is text, as printed; a whole number of TOML is exact, such as a count. `run` calls the check.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Annotated, Literal

from pydantic import Field

from analysis.paper import paper as publication
from analysis.paper.audit.binomial import binomial_p
from analysis.paper.audit.freedom import Bound, ComparisonDesign, Term, degrees_of_freedom, total
from analysis.paper.audit.means import check_count, debit, grim, grimmer, percent_of_count, scale_of
from analysis.paper.audit.p_values import Sides, Statistic, p_against_statistic
from analysis.paper.audit.printed import (
    CheckResult,
    JudgedReadings,
    PlainText,
    PrintedText,
    Rounding,
    read_printed,
)
from analysis.paper.audit.tukey_pattern import ClaimedComparison, tukey_pattern
from analysis.paper.audit.variance_ratios import between_f, repeated_f
from experiments.config.door import Model

CHECKS: Mapping[str, Callable[..., CheckResult]] = MappingProxyType(
    {
        "grim": grim,
        "percent": percent_of_count,
        "grimmer": grimmer,
        "debit": debit,
        "df": degrees_of_freedom,
        "p": p_against_statistic,
        "binomial": binomial_p,
        "repeated-f": repeated_f,
        "between-f": between_f,
        "tukey": tukey_pattern,
        "total": total,
    }
)
"""Name in a paper's file -> check; a claim's other keys are the check's arguments (`AnyClaim` types them)."""


class Claim(Model):
    """One printed number: `place` in the paper, a short `quote`, and a `note` on how the file reads it.

    `about`: the numbers of Recoil's own comparison that it is about, such as "direction: ANOVA F".
    """

    place: str
    quote: str
    note: str = ""
    about: list[str] = Field(default_factory=list)

    def run(self) -> CheckResult:
        """The check of this kind with this claim's numbers; `ValueError` where they make no such claim."""
        own = type(self).model_fields.keys() - Claim.model_fields.keys() - {"kind"}
        return CHECKS[self.kind](**{name: getattr(self, name) for name in own})  # type: ignore[attr-defined]


class ScaleClaim(Claim):
    """About scores in steps of `grain` from `low` to `high`."""

    grain: PrintedText = "1"
    low: PrintedText | None = None
    high: PrintedText | None = None


class MeansClaim(ScaleClaim):
    """An F of several means, which are printed or not."""

    F: PrintedText
    means: list[PrintedText] | None = None


class GrimClaim(ScaleClaim):
    """A mean of n scores in steps of `grain`; see `grim`."""

    kind: Literal["grim"]
    mean: PrintedText
    n: publication.AtLeastOne
    items: publication.AtLeastOne = 1


class PercentClaim(Claim):
    """A percentage with its count of n; see `percent_of_count`."""

    kind: Literal["percent"]
    percent: PrintedText
    count: Annotated[int, Field(ge=0)]
    n: publication.AtLeastOne


class GrimmerClaim(GrimClaim):
    """A mean with its SD; see `grimmer`."""

    kind: Literal["grimmer"]  # type: ignore[assignment]
    sd: PrintedText


class DebitClaim(Claim):
    """Mean and SD of answers of 0 or 1; see `debit`."""

    kind: Literal["debit"]
    mean: PrintedText
    sd: PrintedText
    n: publication.AtLeastOne


class DfClaim(Claim):
    """Degrees of freedom of a design; see `degrees_of_freedom`."""

    kind: Literal["df"]
    df: Annotated[list[PlainText], Field(min_length=1)]
    design: ComparisonDesign
    counts: Annotated[list[publication.AtLeastOne], Field(min_length=1, max_length=26)]


class PClaim(Claim):
    """A p-value, or its bound, of a statistic; see `p_against_statistic`."""

    kind: Literal["p"]
    statistic: Statistic
    value: PrintedText
    df: list[PlainText] = Field(default_factory=list)
    p: PrintedText
    sides: Sides = "two-sided"


class BinomialClaim(Claim):
    """A binomial test's p, for any count of n or some; see `binomial_p`."""

    kind: Literal["binomial"]
    p: PrintedText
    n: publication.AtLeastOne
    chance: str = "1/2"
    counts: list[int] | None = None


class RepeatedFClaim(MeansClaim):
    """F within participants, against its means; see `repeated_f`."""

    kind: Literal["repeated-f"]
    n: publication.AtLeastOne
    k: Annotated[int, Field(ge=1, le=26)]
    transforms: Annotated[list[str], Field(max_length=5)] = Field(default_factory=list)
    other_grains: Annotated[list[PrintedText], Field(max_length=5)] = Field(default_factory=list)


class BetweenFClaim(MeansClaim):
    """F between groups, against their means; see `between_f`."""

    kind: Literal["between-f"]
    sizes: Annotated[list[publication.AtLeastOne], Field(min_length=2, max_length=26)]


class TukeyClaim(MeansClaim):
    """The pattern of a Tukey test; see `tukey_pattern`."""

    kind: Literal["tukey"]
    sizes: Annotated[list[publication.AtLeastOne], Field(min_length=2, max_length=26)]
    comparisons: Annotated[list[ClaimedComparison], Field(min_length=1, max_length=100)]
    repeated: bool = True
    grain: PrintedText | None = None  # type: ignore[assignment]


class TotalClaim(Claim):
    """A number that others add up to, or bound; see `total`."""

    kind: Literal["total"]
    printed: PrintedText
    terms: Annotated[list[Term], Field(min_length=1)]
    bound: Bound = "equals"


class StatedClaim(Claim):
    """A number that nothing else printed bears on, such as one measured constant."""

    kind: Literal["stated"]
    printed: PrintedText
    unit: str = ""

    def run(self) -> CheckResult:
        """Undecided: there is nothing to check it against."""
        return CheckResult(
            check="stated",
            printed=f"{self.printed} {self.unit}".strip(),
            judged=JudgedReadings("undecided"),
            reason="no other printed number bears on it",
            source="the paper",
        )


class UnpublishedClaim(Claim):
    """A quantity that a reader needs and the paper does not print."""

    kind: Literal["unpublished"]
    quantity: str

    def run(self) -> CheckResult:
        """Not published."""
        return CheckResult(
            check="unpublished",
            printed="",
            judged=JudgedReadings("not published"),
            reason=f"{self.quantity}: not printed",
            source="the paper",
        )


def refusal(reason: str) -> CheckResult:
    """The result for a claim that cannot be checked, for this reason."""
    return CheckResult(
        check="refused", printed="", judged=JudgedReadings("refused"), reason=reason, source="the bounds of the audit"
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class AuditFinding:
    """What the audit found of one number: where the paper prints it, in which words, and the check's result.

    `about`: the numbers of Recoil's own comparison that it is about.
    """

    place: str
    quote: str
    note: str
    result: CheckResult
    about: tuple[str, ...] = ()


AnyClaim = Annotated[
    GrimClaim
    | PercentClaim
    | GrimmerClaim
    | DebitClaim
    | DfClaim
    | PClaim
    | BinomialClaim
    | RepeatedFClaim
    | BetweenFClaim
    | TukeyClaim
    | TotalClaim
    | StatedClaim
    | UnpublishedClaim,
    Field(discriminator="kind"),
]
"""Any claim; its `kind` says which."""

RATE_GRAIN, RATING_GRAIN = "0.1", "0.1"
"""Of the correct rate, cor / 10; of the continuous rating scale, assumed: it has no printed grain."""
STARS = {"0.05": "0.01", "0.01": "0.001"}
"""What a star at one level says about the next (caption of Fig. 8)."""


def participants_claims(people: publication.Participants) -> Iterator[Claim]:
    """Of who took part: the sexes add up, the ages span their range."""
    place = "III, Participants"
    sexes = [Term(times=[people.male]), Term(times=[people.female])]
    quote = f"{people.n} participants ({people.male} males and {people.female} females)"
    about = [publication.named_in(name, publication.PARTICIPANTS) for name in ("direction", "preference")]
    yield TotalClaim(place=place, quote=quote, about=about, kind="total", printed=str(people.n), terms=sexes)
    low = [Term(times=[people.age_min])]
    quote = f"ages ranged from {people.age_min} to {people.age_max} years"
    yield TotalClaim(place=place, quote=quote, kind="total", printed=str(people.age_max), terms=low, bound="at least")
    yield UnpublishedClaim(place=place, quote=quote, kind="unpublished", quantity="mean and SD of the ages")


def direction_claims(paper: publication.PublishedDirection) -> Iterator[Claim]:
    """Of experiment 1: its protocol, means, F, post-hoc tests and tests against one half, and what is only drawn."""
    place, protocol = "III.A, Results", paper.protocol
    yield from _protocol(paper)
    trials = str(protocol.forward_trials_per_session)
    for method, mean in paper.means.items():
        yield GrimClaim(
            place=place, quote=f"{method}: {mean}%", kind="grim", mean=f"{mean}%", n=paper.n, grain=RATE_GRAIN,
            low="0", high="1", note=f"rates in steps of 1/{trials}",
            about=[publication.named_in("direction", publication.mean_rate(method))],
        )  # fmt: skip
    means = [f"{paper.means[method]}%" for method in paper.methods]
    yield from _anova(paper, place, means)
    yield from _tukey(paper, place, means)
    n = paper.n * protocol.forward_trials_per_session
    check_count(n, "n times forward_trials_per_session")
    for claim in paper.binomial:
        forward = claim.direction == "forward" and claim.method in paper.means
        counts = _counts(paper.means[claim.method], n) if forward else None
        yield BinomialClaim(
            place=place, quote=f"{claim.method}, {claim.direction}: p = {claim.p}", kind="binomial", p=claim.p, n=n,
            counts=counts, note="pooled over participants",
            about=[publication.named_in("direction", publication.one_half_p(claim))],
        )  # fmt: skip
    for method in paper.methods:
        yield UnpublishedClaim(place="Fig. 8(a)", quote=method, kind="unpublished", quantity=f"SD, {method}")
    yield UnpublishedClaim(
        place=place, quote="shooting backward", kind="unpublished", quantity="correct rates backward"
    )


def _counts(percent: str, n: int) -> list[int]:
    """The counts of n that print as a percentage."""
    return list(scale_of("1", "0", "1").sums(read_printed(f"{percent}%").interval(Rounding.ANY), n))


def _protocol(paper: publication.PublishedDirection) -> Iterator[Claim]:
    place, protocol = "III.A, Method", paper.protocol
    trials = protocol.forward_trials_per_session + protocol.backward_trials_per_session
    terms = [Term(times=[protocol.sets_per_session, protocol.trials_per_set])]
    quote = f"{trials} trials ({protocol.sets_per_session} sets x {protocol.trials_per_set} repetitions)"
    yield TotalClaim(place=place, quote=quote, kind="total", printed=str(trials), terms=terms)
    one_each = [Term(times=[len(paper.methods)])]
    quote = f"{protocol.sessions} sessions corresponded to the rendering methods"
    yield TotalClaim(place=place, quote=quote, kind="total", printed=str(protocol.sessions), terms=one_each)
    breaks = [
        Term(times=[protocol.sessions, protocol.sets_per_session - 1, protocol.set_break_s], over=[60]),
        Term(times=[protocol.sessions - 1, protocol.session_break_s], over=[60]),
    ]
    quote = f"around {protocol.duration_min} minutes; {protocol.set_break_s} s and {protocol.session_break_s} s breaks"
    yield TotalClaim(
        place=place, quote=quote, kind="total", printed=protocol.duration_min, terms=breaks, bound="at least",
        note="the breaks alone, in minutes",
    )  # fmt: skip


def _anova(paper: publication.PublishedExperiment, place: str, means: list[str] | None) -> Iterator[Claim]:
    anova, k = paper.anova, len(paper.methods)
    df = [str(value) for value in anova.df]
    quote = f"F({df[0]},{df[1]})={anova.F}, p<{anova.p_below}"
    name = _name(paper)
    about = [publication.named_in(name, publication.anova_df(part)) for part in ("effect", "error")]
    yield DfClaim(place=place, quote=quote, about=about, kind="df", df=df, design="repeated", counts=[paper.n, k])
    rates = means is not None
    yield RepeatedFClaim(
        place=place, quote=quote, kind="repeated-f", F=anova.F, n=paper.n, k=k, means=means,
        grain=RATE_GRAIN if rates else RATING_GRAIN, low="0", high="1" if rates else _scale_top(paper),
        transforms=["arcsine"] if rates else [], other_grains=["0.05"] if rates else [],
        note="0.05: both directions pooled, 20 trials" if rates else "grain of the continuous scale assumed",
        about=[publication.named_in(name, publication.ANOVA_F)],
    )  # fmt: skip
    p, about = f"< {anova.p_below}", [publication.named_in(name, publication.ANOVA_P)]
    yield PClaim(place=place, quote=quote, about=about, kind="p", statistic="F", value=anova.F, df=df, p=p)


def _name(paper: publication.PublishedExperiment) -> str:
    return "preference" if isinstance(paper, publication.PublishedPreference) else "direction"


def _scale_top(paper: publication.PublishedExperiment) -> str:
    return str(paper.scale_max) if isinstance(paper, publication.PublishedPreference) else "1"


def _tukey(paper: publication.PublishedExperiment, place: str, means: list[str] | None) -> Iterator[Claim]:
    index = {method: i for i, method in enumerate(paper.methods)}
    pairs = [
        ClaimedComparison(
            higher=index[claim.higher], lower=index[claim.lower], p=f"< {claim.p_below}",
            p_at_least=STARS.get(claim.p_below),
        )
        for claim in paper.tukey
    ]  # fmt: skip
    quote = "; ".join(f"{claim.higher} above {claim.lower} (p<{claim.p_below})" for claim in paper.tukey)
    rates = means is not None
    yield TukeyClaim(
        place=place, quote=quote, kind="tukey", F=paper.anova.F, sizes=[paper.n] * len(paper.methods),
        comparisons=pairs, means=means, grain=RATE_GRAIN if rates else None, low="0" if rates else None,
        high="1" if rates else None, note="stars of Fig. 8: p < .05 also says not below .01",
        about=[publication.named_in(_name(paper), publication.tukey_p(claim)) for claim in paper.tukey],
    )  # fmt: skip


def preference_claims(paper: publication.PublishedPreference) -> Iterator[Claim]:
    """Of experiment 2: its protocol, F, post-hoc tests and shares of participants, and what is only drawn."""
    place, n = "III.B, Results", paper.n
    trials = [Term(times=[len(paper.methods)])]
    quote = f"{paper.protocol.trials} trials corresponded to the rendering methods"
    yield TotalClaim(place="III.B, Method", quote=quote, kind="total", printed=str(paper.protocol.trials), terms=trials)
    yield from _anova(paper, place, None)
    yield from _tukey(paper, place, None)
    lowest = f"{round(100 * paper.lowest.participants / n)}%"
    yield PercentClaim(
        place=place, quote=f"{lowest} of the participants gave lower scores for {paper.lowest.method}", kind="percent",
        percent=lowest, count=paper.lowest.participants, n=n,
        about=[publication.named_in("preference", publication.rated_lowest(paper.lowest))],
    )  # fmt: skip
    for method in paper.methods:
        yield UnpublishedClaim(place="Fig. 8(b)", quote=method, kind="unpublished", quantity=f"mean and SD, {method}")
