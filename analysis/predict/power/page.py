"""What `recoil power` found and what it assumed, as sections: smallest designs, published pattern, curves, tables."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import Literal, TypeVar

from analysis.paper.recurrence import ShareOfStudies
from analysis.predict.drawn import RatingStudies
from analysis.predict.power.figures import Curve, Panel, figure_false_positives, figure_power
from analysis.predict.power.grid import PUBLISHED, Grid
from analysis.predict.power.planned import ALL_PAIRS, ANOVA, ANY_PAIR
from analysis.predict.power.results import PATTERN, DesignPower, Power, PublishedPattern, Reached, Smallest
from analysis.predict.synthetic_studies import bias_mean, rates_words, ratings_words, spread_sentence
from analysis.report import apa
from analysis.report.labels import display_name, named
from analysis.report.section import Picture, Section, Table, origin_table
from experiments.synthetic.laws import DiffusionLaw, RatesLaw, RatingsLaw

XAxis = Literal["participants", "trials"]
One = TypeVar("One")

HEADLINES = (ANOVA, ALL_PAIRS, PATTERN)
"""What is told first, where there is room for little."""
TEXTBOOK = (
    "The row of the noncentral F is the textbook's power of the ANOVA (Cohen 1988), beside the simulated one above it: "
    "from f, that of the partial eta squared of these studies, for scores that are normal and spherical. Where the two "
    "differ, floors, ceilings or unequal spreads make the difference."
)
MOST_TABLES = 12
"""A page of more tables is read by nobody; `power.json` holds all."""


def sections(found: Power, figures: Path) -> tuple[Section, ...]:
    """The page's sections; their figures are written."""
    parts = [_false_positives(found, figures)] if found.null else list(_power(found, figures))
    return (in_short(found), *parts, _origin(found))


def in_short(found: Power) -> Section:
    """What a reader looks for, in a few lines."""
    lines = _false_positive_lines(found) if found.null else _power_lines(found)
    return Section(title=f"{found.title}: {found.studies} studies of each design", items=tuple(lines))


def _false_positive_lines(found: Power) -> Iterator[str]:
    for design in found.designs:
        rates = ", ".join(f"{share.claim} {share_cell(share)}" for share in design.claims)
        yield f"{design.participants} people {design.people}, false positives in % of the studies: {rates}"


def _power_lines(found: Power) -> Iterator[str]:
    yield from filter(None, [_pattern_sentence(found.published_pattern)])
    headlines = [row for row in found.smallest if row.claim in HEADLINES]
    for rows in _grouped(headlines, lambda row: (row.claim, row.methods)):
        methods = f" of {_listed(rows[0].methods)}" if _varies(found, "methods") else ""
        reached = "; ".join(f"{_effect(row.effect)}: {_reached(found, row)}" for row in rows)
        target = apa.percent(found.target, 0)
        yield f"The smallest design that reaches {target} for {claim_name(rows[0].claim)}{methods}: {reached}"
    if too_long := sum(bool(design.too_long) for design in found.designs):
        yield f"{too_long} of {len(found.designs)} designs keep a participant too long; none of them is proposed."


def claim_name(claim: str) -> str:
    """A claim as people read it, with methods by their labels."""
    return "the paper's whole pattern" if claim == PATTERN else named(claim, words=True)


def _listed(methods: Sequence[str]) -> str:
    return ", ".join(map(display_name, methods))


def share_cell(share: ShareOfStudies | None) -> str:
    """A share with its interval, in percent."""
    return apa.NO_NUMBER if share is None else f"{apa.number(100.0 * share.share, 1)} {_bounds(share)}"


def _bounds(share: ShareOfStudies | PublishedPattern) -> str:
    return apa.interval(100.0 * share.ci_low, 100.0 * share.ci_high, 1)


def _pattern_sentence(pattern: PublishedPattern | None) -> str:
    """The chance that the paper's whole pattern recurs."""
    if pattern is None:
        return ""
    return (
        f"With n = {pattern.participants} the paper's whole pattern of significance recurs in "
        f"{apa.percent(pattern.share)} of the studies (95 % CI {_bounds(pattern)} %)."
    )


def _varies(found: Power, key: str) -> bool:
    """Whether the designs differ in this."""
    return len({getattr(design, key) for design in found.designs}) > 1


def _is_aim(claim: str) -> bool:
    """Whether a plan may aim at a claim: any but `any pair`, and of the published ones the whole pattern alone."""
    return claim != ANY_PAIR and (claim == PATTERN or not claim.startswith(PUBLISHED))


def _power(found: Power, figures: Path) -> Iterator[Section]:
    yield _smallest(found)
    if found.published_pattern:
        yield _pattern(found.studies, found.published_pattern)
    groups = _grouped(found.designs, lambda one: (one.methods, one.trials, one.effect))
    cut = (f"{len(groups) - MOST_TABLES} more combinations are in power.json.",) if len(groups) > MOST_TABLES else ()
    shown = groups[:MOST_TABLES]
    yield Section(
        title="Power",
        paragraphs=(
            "Each share is of simulated studies; the bands are its 95 % interval; power.json has them all.",
            TEXTBOOK,
            *cut,
        ),
        pictures=tuple(_pictures(found, figures)),
        tables=tuple(_power_table(group) for group in shown),
    )
    yield Section(
        title="Precision",
        paragraphs=(
            "Half the length of the 95 % interval to expect, in the mean over studies: of a difference by Tukey's "
            "simultaneous interval, of a mean by Student's t over people.",
        ),
        tables=tuple(_precision_table(group) for group in shown),
    )


def _smallest(found: Power) -> Section:
    target = apa.percent(found.target, 0)
    rows = [row for row in found.smallest if _is_aim(row.claim)]
    effects = sorted({row.effect for row in rows})
    tables = []
    for group in _grouped(rows, lambda row: row.methods):
        claims = list(dict.fromkeys(row.claim for row in group))
        by_place = {(row.claim, row.effect): row for row in group}
        body = tuple(
            (claim_name(claim), *(_reached(found, by_place.get((claim, effect))) for effect in effects))
            for claim in claims
        )
        caption = f"The smallest design of this grid that reaches {target}: {_listed(group[0].methods)}"
        tables.append(Table(caption=caption, header=("What is to be found", *map(_effect, effects)), rows=body))
    return Section(
        title=f"The smallest design that reaches {target}",
        paragraphs=(
            "Smallest is fewest hours in the lab, then fewest participants, among the designs that were simulated and "
            f"keep nobody too long. It counts as reaching {target} if the lower end of its interval does.",
            *_too_long(found),
        ),
        tables=tuple(tables),
    )


def _reached(found: Power, row: Smallest | None) -> str:
    if row is None:
        return apa.NO_NUMBER
    if row.design is None and _reached_too_long(found, row):
        return f"none: what reaches it keeps a participant too long (at most {apa.percent(row.most)})"
    if row.design is None:
        return f"none whose interval reaches it (at most {apa.percent(row.most)})"
    return _design_name(row.design, with_trials=_varies(found, "trials"))


def _reached_too_long(found: Power, row: Smallest) -> bool:
    """Whether a design reaches the target, and may not be run."""
    same = [one for one in found.designs if one.too_long and (one.effect, one.methods) == (row.effect, row.methods)]
    shares = [one.share_of(row.claim) for one in same]
    return any(share is not None and share.ci_low >= found.target for share in shares)


def _design_name(design: Reached, *, with_trials: bool) -> str:
    """A smallest design in a cell; with its trials where the grid has several numbers of them."""
    trials = f" × {design.trials} trials a method" if with_trials else ""
    return f"{design.participants} people{trials}, {apa.number(design.lab_hours, 1)} h"


def _too_long(found: Power) -> Iterator[str]:
    for one in _grouped([one for one in found.designs if one.too_long], lambda one: one.too_long):
        yield f"{one[0].trials} trials of each of {len(one[0].methods)} methods: {one[0].too_long}."


def _pattern(studies: int, pattern: PublishedPattern) -> Section:
    rows = tuple((claim_name(one.claim).removeprefix(f"{PUBLISHED}, "), share_cell(one)) for one in pattern.claims)
    caption = f"{studies} studies of {pattern.participants} people, {pattern.trials} trials a method"
    return Section(
        title="Would the published pattern recur?",
        paragraphs=(_pattern_sentence(pattern),),
        tables=(Table(caption=caption, header=("Published claim", "Recurs, % of studies [95 % CI]"), rows=rows),),
    )


def _power_table(group: Sequence[DesignPower]) -> Table:
    names = [name for name in _claims(group) if _is_aim(name)]
    rows = [(claim_name(name), *(_percent(one.share_of(name)) for one in group)) for name in names]
    rows.insert(names.index(ANOVA) + 1, ("ANOVA, noncentral F (f)", *(_from_f(one) for one in group)))
    widest = max((share.ci_high - share.ci_low) / 2.0 for one in group for share in one.claims)
    caption = f"Power in % of studies, 95 % intervals at most ±{apa.number(100.0 * widest, 1)}: {_setting(group[0])}"
    return _table(caption, "Significant", rows, group)


def _claims(designs: Iterable[DesignPower]) -> list[str]:
    """The claims of all designs, each once."""
    return list(dict.fromkeys(share.claim for one in designs for share in one.claims))


def _precision_table(group: Sequence[DesignPower]) -> Table:
    names = [one.measure for one in group[0].precision]
    rows = [(name, *(_half_width(one, name) for one in group)) for name in names]
    return _table(f"Half-widths: {_setting(group[0])}", "95 % interval of", rows, group)


def _table(caption: str, corner: str, rows: Sequence[tuple[str, ...]], group: Sequence[DesignPower]) -> Table:
    """A column for each number of participants, the hours in the lab first."""
    hours = ("hours in the lab", *(apa.number(one.lab_hours, 1) for one in group))
    header = (f"{corner} / participants", *(str(one.participants) for one in group))
    return Table(caption=caption, header=header, rows=(hours, *rows))


def _percent(share: ShareOfStudies | None) -> str:
    return apa.NO_NUMBER if share is None else apa.number(100.0 * share.share, 1)


def _from_f(design: DesignPower) -> str:
    """The textbook's power in percent with its effect size."""
    found = design.textbook
    return apa.NO_NUMBER if found is None else f"{apa.number(100.0 * found.power, 1)} ({apa.number(found.f, 2)})"


def _half_width(design: DesignPower, measure: str) -> str:
    return apa.number(next(one.half_width for one in design.precision if one.measure == measure), 3)


def _pictures(found: Power, figures: Path) -> Iterator[Picture]:
    """A figure for each set of methods."""
    for number, group in enumerate(_grouped(found.designs, lambda one: one.methods), start=1):
        stem = "power" if number == 1 else f"power-{number}"
        x: XAxis = "participants" if len({one.participants for one in group}) > 1 else "trials"
        label = {"participants": "participants", "trials": "trials a method"}[x]
        figure_power(_panels(group, x), label, found.target, figures / stem)
        yield Picture(
            stem=stem,
            caption=f"Power over {label}; bands: 95 % Monte Carlo intervals. Methods: {_listed(group[0].methods)}",
            alt=f"Curves of the share of studies in which each claim is found, over {label}",
        )


def _panels(group: Sequence[DesignPower], x: XAxis) -> list[list[Panel]]:
    """A panel an effect, a curve a claim; with several numbers of trials a row a claim, a curve a number of trials."""
    by_effect = _grouped(group, lambda one: one.effect)
    trials = sorted({one.trials for one in group})
    claims = [name for name in HEADLINES if name in _claims(group)]
    if x == "trials" or len(trials) == 1:
        return [[Panel(title=_effect(some[0].effect), curves=_curves(some, claims, x)) for some in by_effect]]
    return [
        [
            Panel(
                title=f"{claim_name(claim)}\n{_effect(some[0].effect)}",
                curves=[
                    _curve([one for one in some if one.trials == each], claim, x, f"{each} trials a method")
                    for each in trials
                ],
            )
            for some in by_effect
        ]
        for claim in claims
    ]


def _curves(designs: Sequence[DesignPower], claims: Sequence[str], x: XAxis) -> list[Curve]:
    return [_curve(designs, claim, x, claim_name(claim)) for claim in claims]


def _curve(designs: Sequence[DesignPower], claim: str, x: XAxis, name: str) -> Curve:
    points = [(getattr(one, x), share) for one in designs if (share := one.share_of(claim)) is not None]
    return Curve(name=name, points=points)


def _false_positives(found: Power, figures: Path) -> Section:
    groups = _grouped(found.designs, lambda one: (one.methods, one.trials, one.participants))
    panels = [(f"{some[0].participants} people", some) for some in groups[:4]]
    figure_false_positives(panels, found.level, figures / "false-positives")
    return Section(
        title="False positives of null participants",
        paragraphs=("Each share is of simulated studies in which there is nothing to be found; 5 % is claimed.",),
        pictures=(
            Picture(
                stem="false-positives",
                caption="False positives with their 95 % Monte Carlo intervals; dashed: the nominal 5 %",
                alt="Points with intervals for each test beside the line of 5 %",
            ),
        ),
        tables=tuple(_null_table(some) for some in groups[:MOST_TABLES]),
    )


def _null_table(group: Sequence[DesignPower]) -> Table:
    one = group[0]
    rows = tuple((claim, *(share_cell(design.share_of(claim)) for design in group)) for claim in _claims(group[:1]))
    return Table(
        caption=(
            f"False positives, % of studies [95 % CI]: {one.participants} people, {one.trials} trials a method; "
            f"{ANY_PAIR} is the familywise error"
        ),
        header=("Test", *(design.people for design in group)),
        rows=rows,
    )


def _origin(found: Power) -> Section:
    facts = {"seed": found.seed, "studies of each design": found.studies, **found.provenance}
    return Section(title="What this rests on", tables=(origin_table(facts),), items=found.assumptions)


def _grouped(some: Iterable[One], key: Callable[[One], object]) -> list[list[One]]:
    """Those with the same key together, in the order of their first."""
    groups: dict[object, list[One]] = {}
    for one in some:
        groups.setdefault(key(one), []).append(one)
    return list(groups.values())


def _setting(design: DesignPower) -> str:
    methods = _listed(design.methods)
    return f"{_effect(design.effect)}, {design.trials} trials a method ({methods})"


def _effect(effect: float) -> str:
    return f"effect × {effect:g}"


def grid_assumptions(grid: Grid) -> list[str]:
    """What the numbers rest on."""
    config, null = grid.config, grid.request.null
    if isinstance(config, RatingStudies):
        law = list(_null_ratings(config.law) if null else _ratings(config.law))
    elif isinstance(config.law, DiffusionLaw):
        law = list(_felt(config.law, config.instructions, null=null))
    else:
        law = list(_null_guessing(config.law) if null else _rates(config.law, config.methods))
    return [
        *law,
        "All tests are at 5 %, two-sided; Tukey's test is on the pooled repeated-measures error. A comparison counts "
        "only if it comes out the way round that the config's means have it; where they are equal, either way counts, "
        "as always in a binomial test.",
        "Every participant is complete: nobody drops out or misses an answer.",
        "Hours in the lab are participants times the config's own duration (trials and breaks, as `recoil check` has "
        "it), one participant after another, without practice, preparation and no-shows.",
        "Intervals are Wilson's, of 95 %: the Monte Carlo error of so many studies, not the uncertainty of the "
        "assumed participants.",
    ]


def _rates(law: RatesLaw, methods: Sequence[str]) -> Iterator[str]:
    yield from rates_words(law, methods)
    yield "The effect is a factor on the probit of each mean correct rate, so on d′: 1 is the config, 0 guessing."


def _null_guessing(law: RatesLaw) -> Iterator[str]:
    yield "Null participants feel no direction: each answer is right with a chance of one half in the mean over people."
    yield (
        "Those with the config's bias differ in their readiness to say forward (SD "
        f"{law.bias_sd:g} around {bias_mean(law):g}, probit units). The pooled binomial test takes trials as "
        "independent and rejects them more often than 5 %: trials come in people. The exact test of plain guessers "
        "stays at or below 5 %, as counts are whole numbers."
    )


def _felt(law: DiffusionLaw, instructions: Sequence[str], *, null: bool) -> Iterator[str]:
    percept, people, lapses = law.percept, law.people, law.diffusion.lapses
    yield (
        f"People answer from what the gun does: exponent {percept.exponent:g}, leak {percept.leak_s:g} s, sensitivity "
        f"{percept.sensitivity:g}, confusion {percept.confusion:g}, start {percept.start:g} (`recoil fit`): a model's "
        "guess, not a measurement."
    )
    yield f"{spread_sentence(people.own)} Lapses {lapses.rate:g}."
    if instructions:
        yield (
            f"Instructions {', '.join(instructions)}: each takes an equal part of a session's sets and "
            "has its own boundary; the planned analysis counts all trials together."
        )
    if null:
        yield (
            "Null participants feel nothing: the evidence is 0, so each answers “forward” at the chance of their own "
            "start: 0.5 for those who guess, the config's and its spread for those with the config's bias. The pooled "
            "binomial test of the latter rejects as often as the bias is found, which is no false positive of a "
            "direction felt; the exact test of plain guessers stays at or below 5 %, as counts are whole numbers."
        )
    else:
        yield "The effect is a factor on the evidence (log odds of a right answer): 1 is the config, 0 nothing felt."


def _ratings(law: RatingsLaw) -> Iterator[str]:
    yield from ratings_words(law, tuple(law.mean), with_effect=True)
    yield "The effect is a factor on the distances of the methods' means from their common mean; 1 is the config."


def _null_ratings(law: RatingsLaw) -> Iterator[str]:
    yield (
        f"Null participants like all methods alike: one mean, SD between people {law.person_sd:g}, within people "
        f"{law.noise_sd:g}, none of the habits that set methods apart."
    )
