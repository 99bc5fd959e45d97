"""The claims of a paper's file: where it says what, and which check it calls with what arguments.

A number that is rounded is text, as printed; a whole number of TOML is exact, such as a count. `run` calls the check.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Annotated, Any, ClassVar, Literal

from pydantic import AfterValidator, Field

from analysis.paper.audit.freedom import ComparisonDesign, degrees_of_freedom
from analysis.paper.audit.means import grim, percent_of_count
from analysis.paper.audit.p_values import Sides, Statistic, binomial_p, p_against_statistic
from analysis.paper.audit.printed import read_printed
from analysis.paper.audit.spreads import debit, grimmer
from analysis.paper.audit.totals import Bound, Term, total
from analysis.paper.audit.tukey_pattern import ClaimedComparison, tukey_pattern
from analysis.paper.audit.variance_ratios import between_f, repeated_f
from analysis.paper.audit.words import CheckResult
from analysis.paper.paper import AtLeastOne
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
"""Name in a paper's file -> check; a claim's other keys are the check's arguments (`paper_file` types them)."""


def _is_printed(text: str) -> str:
    read_printed(text)
    return text


PrintedText = Annotated[str, AfterValidator(_is_printed)]
"""A number or a bound as printed: "28.45", ".205", "< .001", "64.3%"."""


class Claim(Model):
    """One printed number: `place` in the paper, a short `quote`, and a `note` on how the file reads it.

    `about`: the numbers of Recoil's own comparison that it is about, such as "direction: ANOVA F".
    """

    place: str
    quote: str
    note: str = ""
    about: list[str] = Field(default_factory=list)
    not_arguments: ClassVar[frozenset[str]] = frozenset({"place", "quote", "note", "about", "kind"})

    def run(self) -> CheckResult:
        """The check of this kind with this claim's numbers; `ValueError` where they make no such claim."""
        return CHECKS[self.kind](**self.arguments())  # type: ignore[attr-defined]

    def arguments(self) -> dict[str, Any]:
        """The check's arguments."""
        return {name: getattr(self, name) for name in type(self).model_fields if name not in self.not_arguments}


class GrimClaim(Claim):
    """A mean of n scores in steps of `grain`; see `grim`."""

    kind: Literal["grim"]
    mean: PrintedText
    n: AtLeastOne
    grain: PrintedText = "1"
    items: AtLeastOne = 1
    low: PrintedText | None = None
    high: PrintedText | None = None


class PercentClaim(Claim):
    """A percentage with its count of n; see `percent_of_count`."""

    kind: Literal["percent"]
    percent: PrintedText
    count: Annotated[int, Field(ge=0)]
    n: AtLeastOne


class GrimmerClaim(GrimClaim):
    """A mean with its SD; see `grimmer`."""

    kind: Literal["grimmer"]  # type: ignore[assignment]
    sd: PrintedText


class DebitClaim(Claim):
    """Mean and SD of answers of 0 or 1; see `debit`."""

    kind: Literal["debit"]
    mean: PrintedText
    sd: PrintedText
    n: AtLeastOne


class DfClaim(Claim):
    """Degrees of freedom of a design; see `degrees_of_freedom`."""

    kind: Literal["df"]
    df: Annotated[list[PrintedText], Field(min_length=1)]
    design: ComparisonDesign
    counts: Annotated[list[AtLeastOne], Field(min_length=1)]


class PClaim(Claim):
    """A p-value, or its bound, of a statistic; see `p_against_statistic`."""

    kind: Literal["p"]
    statistic: Statistic
    value: PrintedText
    df: list[PrintedText] = Field(default_factory=list)
    p: PrintedText
    sides: Sides = "two-sided"


class BinomialClaim(Claim):
    """A binomial test's p, for any count of n or some; see `binomial_p`."""

    kind: Literal["binomial"]
    p: PrintedText
    n: AtLeastOne
    chance: str = "1/2"
    counts: list[int] | None = None


class RepeatedFClaim(Claim):
    """F within participants, against its means; see `repeated_f`."""

    kind: Literal["repeated-f"]
    F: PrintedText
    n: AtLeastOne
    k: AtLeastOne
    means: list[PrintedText] | None = None
    grain: PrintedText = "1"
    low: PrintedText | None = None
    high: PrintedText | None = None
    transforms: list[str] = Field(default_factory=list)
    other_grains: list[PrintedText] = Field(default_factory=list)


class BetweenFClaim(Claim):
    """F between groups, against their means; see `between_f`."""

    kind: Literal["between-f"]
    F: PrintedText
    sizes: Annotated[list[AtLeastOne], Field(min_length=2)]
    means: list[PrintedText] | None = None
    grain: PrintedText = "1"
    low: PrintedText | None = None
    high: PrintedText | None = None


class TukeyPair(Model):
    """Mean `higher` above mean `lower`, by their places from 0; see `ClaimedComparison`."""

    higher: int
    lower: int
    p: PrintedText
    p_at_least: PrintedText | None = None


class TukeyClaim(Claim):
    """The pattern of a Tukey test; see `tukey_pattern`."""

    kind: Literal["tukey"]
    F: PrintedText
    sizes: Annotated[list[AtLeastOne], Field(min_length=2)]
    comparisons: Annotated[list[TukeyPair], Field(min_length=1)]
    means: list[PrintedText] | None = None
    repeated: bool = True
    grain: PrintedText | None = None
    low: PrintedText | None = None
    high: PrintedText | None = None

    def arguments(self) -> dict[str, Any]:
        """The check's arguments, the pairs as its own words."""
        pairs = [ClaimedComparison(**pair.model_dump()) for pair in self.comparisons]
        return super().arguments() | {"comparisons": pairs}


class TermModel(Model):
    """A product of factors over divisors; see `Term`."""

    times: Annotated[list[int | PrintedText], Field(min_length=1)]
    over: list[int | PrintedText] = Field(default_factory=list)


class TotalClaim(Claim):
    """A number that others add up to, or bound; see `total`."""

    kind: Literal["total"]
    printed: PrintedText
    terms: Annotated[list[TermModel], Field(min_length=1)]
    bound: Bound = "equals"

    def arguments(self) -> dict[str, Any]:
        """The check's arguments, the terms as its own words."""
        return super().arguments() | {"terms": [Term(times=term.times, over=term.over) for term in self.terms]}


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
            verdict="undecided",
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
            verdict="not published",
            reason=f"{self.quantity}: not printed",
            source="the paper",
        )


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
