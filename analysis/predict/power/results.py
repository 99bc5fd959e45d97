"""What simulated power comes to: each design's shares and half-widths, the smallest designs, the published pattern."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass, field

from analysis.paper.recurrence import WHOLE_PATTERN, ShareOfStudies
from analysis.predict.power.grid import PUBLISHED, Grid, GridCell, StudyDesign
from analysis.predict.power.planned import Precision, Tally, TextbookPower, merged, precisions, shares, textbook_power
from analysis.report.serial import NotebookResult, beside, plain
from analysis.stats.corrections import SIGNIFICANT
from experiments.record.provenance import provenance

PATTERN = f"{PUBLISHED}, {WHOLE_PATTERN}"


@dataclass(frozen=True, slots=True, kw_only=True)
class DesignPower(StudyDesign):
    """A design, what it costs, and what studies of it found; `too_long` says why it keeps a participant too long.

    `textbook`: the power of the ANOVA from its effect size, beside the simulated one.
    """

    duration_s: float
    lab_hours: float
    too_long: str
    claims: tuple[ShareOfStudies, ...]
    precision: tuple[Precision, ...]
    textbook: TextbookPower | None

    def share_of(self, claim: str) -> ShareOfStudies | None:
        """The share of studies in which a claim held; `None` if it is none of this design's."""
        return next((share for share in self.claims if share.claim == claim), None)


@dataclass(frozen=True, slots=True, kw_only=True)
class Reached:
    """The cheapest design at which a claim holds often enough, and how often."""

    participants: int
    trials: int
    lab_hours: float
    claim: ShareOfStudies = field(metadata=beside(ShareOfStudies))


@dataclass(frozen=True, slots=True, kw_only=True)
class Smallest:
    """For a claim, an effect and a set of methods: the design that reaches the target, and the most that any does."""

    claim: str
    effect: float
    methods: tuple[str, ...]
    design: Reached | None
    most: float


@dataclass(frozen=True, slots=True, kw_only=True)
class PublishedPattern:
    """The published claims at the paper's own design: how often the whole pattern recurs, and each claim alone."""

    participants: int
    trials: int
    lab_hours: float
    share: float
    ci_low: float
    ci_high: float
    claims: tuple[ShareOfStudies, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Power(NotebookResult):
    """The content of `power.json`."""

    experiment: str
    title: str
    seed: int
    studies: int
    level: float
    target: float
    null: bool
    designs: tuple[DesignPower, ...]
    smallest: tuple[Smallest, ...]
    published_pattern: PublishedPattern | None
    assumptions: tuple[str, ...]
    provenance: dict[str, str]

    def rows(self) -> list[dict[str, object]]:
        """A row a design and claim: how often the claim held, with its interval."""
        return [
            {"participants": one.participants, "trials": one.trials, "effect": one.effect, **plain(claim)}
            for one in self.designs
            for claim in one.claims
        ]


def power_of(grid: Grid, tallies: Iterator[Tally], assumptions: Iterable[str]) -> Power:
    """What the tallies of a grid's chunks, in their order, come to."""
    cells, request = grid.all_cells, grid.request
    designs = [_design(cell, merged([next(tallies) for _ in grid.chunks_of(cell)])) for cell in cells]
    own = designs[: len(grid.cells)]
    return Power(
        experiment=grid.config.design.design,
        title=grid.config.design.title,
        seed=request.seed,
        studies=request.studies,
        level=SIGNIFICANT,
        target=request.target,
        null=request.null,
        designs=tuple(own),
        smallest=() if request.null else tuple(_smallest(own, request.target)),
        published_pattern=_pattern(designs[cells.index(grid.reference)]) if grid.reference else None,
        assumptions=tuple(assumptions),
        provenance=provenance(),
    )


def _design(cell: GridCell, tally: Tally) -> DesignPower:
    return DesignPower(
        **asdict(cell.design),
        duration_s=cell.duration_s,
        lab_hours=cell.lab_hours,
        too_long=cell.too_long,
        claims=shares(tally),
        precision=precisions(tally),
        textbook=textbook_power(tally, cell.design.participants, len(cell.design.methods)),
    )


def _pattern(design: DesignPower) -> PublishedPattern:
    claims = tuple(one for one in design.claims if one.claim.startswith(PUBLISHED))
    whole = next(one for one in claims if one.claim == PATTERN)
    return PublishedPattern(
        participants=design.participants,
        trials=design.trials,
        lab_hours=design.lab_hours,
        share=whole.share,
        ci_low=whole.ci_low,
        ci_high=whole.ci_high,
        claims=claims,
    )


def _smallest(designs: Sequence[DesignPower], target: float) -> Iterator[Smallest]:
    """For each effect and set of methods: the cheapest design at which each claim holds often enough."""
    for effect, methods in dict.fromkeys((one.effect, one.methods) for one in designs):
        group = [one for one in designs if (one.effect, one.methods) == (effect, methods)]
        for place, claim in enumerate(one.claim for one in group[0].claims):
            reached = [one.claims[place] for one in group]
            yield Smallest(
                claim=claim,
                effect=effect,
                methods=methods,
                design=_cheapest(zip(group, reached, strict=True), target),
                most=max(one.share for one in reached),
            )


def _cheapest(designs: Iterable[tuple[DesignPower, ShareOfStudies]], target: float) -> Reached | None:
    """Of those that keep nobody too long and whose share is at least `target` even at its interval's lower end.

    Cheapest is fewest hours in the lab, then fewest participants; None if none reaches the target.
    """
    reaching = (
        Reached(participants=one.participants, trials=one.trials, lab_hours=one.lab_hours, claim=share)
        for one, share in designs
        if not one.too_long and share.ci_low >= target
    )
    return min(reaching, key=lambda one: (one.lab_hours, one.participants), default=None)
