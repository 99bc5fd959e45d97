"""The results of the two experiments as sections of a report: what was found, in sentences and in tables."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import islice

from analysis.logs.measures import scale_of_others
from analysis.logs.setups import pooled_setups
from analysis.report import apa
from analysis.report.labels import display_name
from analysis.report.section import LISTED, SHOWN, Section, Table
from analysis.stats.corrections import SIGNIFICANT
from analysis.stats.paired import PairedT
from analysis.summary.results import ConfidenceInterval, DirectionStatistics, Pair, WithinStatistics
from analysis.summary.sections.content import NOT_CORRECTED, TWO_PEOPLE, ReportData, has_many
from analysis.summary.sections.pictures import directions_picture


@dataclass(frozen=True, slots=True, kw_only=True)
class PrintedMeasure:
    """How the scores of an experiment are printed: `scale` times the stored value; `unit` of values, of differences."""

    words: str
    scale: float
    digits: int
    unit: str
    unit_of_differences: str

    def value(self, value: float) -> str:
        """A single value."""
        return f"{apa.number(self.scale * value, self.digits)}{self.unit}"

    def mean(self, mean: float, sd: float) -> str:
        """A mean with its SD, for a sentence; the SD of percentages is in percentage points."""
        spread = apa.number(self.scale * sd, self.digits)
        return f"M = {self.value(mean)}, SD = {spread}{self.unit_of_differences}"

    def difference(self, value: float) -> str:
        """The size of a difference."""
        return f"{apa.number(self.scale * abs(value), self.digits)}{self.unit_of_differences}"

    def interval(self, low: float, high: float) -> str:
        """The ends of an interval, without a unit."""
        return apa.interval(self.scale * low, self.scale * high, self.digits)


PRINTED_MEASURES = {
    "direction": PrintedMeasure(
        words="the correct rate on forward shots",
        scale=100.0,
        digits=1,
        unit=" %",
        unit_of_differences=" percentage points",
    ),
    "preference": PrintedMeasure(words="the rating", scale=1.0, digits=2, unit="", unit_of_differences=""),
}
_WITHIN = "The 95 % CI is within-subject (Cousineau–Morey): it tells of differences between methods, not between people"
_CUT = "; cut at the end of the scale, beyond which no mean lies"


def effect_sentence(found: WithinStatistics, experiment: str, *, full: bool = False) -> str:
    """What the ANOVA found, and the means; `full`: with the exact p and all effect sizes."""
    printed = PRINTED_MEASURES[experiment]
    means = _means_words(found, printed)
    anova = found.anova
    if anova is None:
        return f"{means} There were too few participants or methods for a test."
    if math.isnan(anova.p):
        return f"{means} Nothing differs: all scores are equal, so the {anova.name} has neither F nor p."
    effect = "had a significant effect" if anova.p < SIGNIFICANT else "had no significant effect"
    test = f"{apa.f_test(anova.F, anova.df, anova.p, exact=full)}{_sizes(found, full=full)}"
    few = f" {TWO_PEOPLE}" if found.n == 2 else ""
    return f"The rendering method {effect} on {printed.words}{_lost(found, full=full)}, {test}.{few} {means}"


def _lost(found: WithinStatistics, *, full: bool) -> str:
    """Of an effect that is significant without the correction for sphericity alone: the corrected p, in brackets."""
    corrected = found.supplement.sphericity.greenhouse_geisser if found.supplement else None
    if found.anova is None or corrected is None or not found.anova.p < SIGNIFICANT <= corrected.p:
        return ""
    told = f"Greenhouse–Geisser ε = {apa.below_one(corrected.epsilon)}, {apa.p_value(corrected.p, exact=full)}"
    return f" ({NOT_CORRECTED}: {told})"


def _means_words(found: WithinStatistics, printed: PrintedMeasure) -> str:
    """The means with their SDs; of one participant the values."""
    if found.n == 1:
        values = ", ".join(f"{display_name(m)}: {printed.value(found.means[m])}" for m in found.methods)
        return f"{printed.words[:1].upper()}{printed.words[1:]} of {found.people}: {values}."
    told = {m: f"{display_name(m)}: {printed.mean(found.means[m], found.sds[m])}" for m in found.methods}
    opening = f"{printed.words[:1].upper()}{printed.words[1:]} of {found.people}"
    if has_many(found):
        low, high = (told[end(found.methods, key=found.means.__getitem__)] for end in (min, max))
        return f"{opening}, lowest and highest of {len(told)} means: {low}; {high}. The table has all."
    return f"{opening}: {'; '.join(told.values())}."


def _sizes(found: WithinStatistics, *, full: bool) -> str:
    """The effect sizes behind a comma, as far as there are any."""
    size = found.supplement.effect_size.size if found.supplement else None
    if size is None or size.partial_eta_squared is None:
        return ""
    partial = f", partial η² = {apa.below_one(size.partial_eta_squared)}"
    if not full:
        return partial
    ends = "" if size.ci_90 is None else f", 90 % CI [{', '.join(map(apa.below_one, size.ci_90))}]"
    return f"{partial}{ends}, generalised η² = {apa.below_one(size.generalized_eta_squared)}"


def pairs_sentence(found: WithinStatistics, experiment: str, *, full: bool = False, planned: bool = True) -> str:
    """The comparisons of all pairs; empty where nothing was tested. `full`: with intervals, the exact p and d_z."""
    if not found.tukey or found.supplement is None:
        return ""
    if has_many(found):
        differing = sum(pair.p < SIGNIFICANT for pair in found.tukey)
        told = f"{differing or 'none'} of {len(found.tukey)} pairs differed significantly; the table has all"
        return f"{comparisons(planned=planned)} (Tukey's HSD): {told}."
    if all(math.isnan(pair.p) for pair in found.tukey):
        return f"{comparisons(planned=planned)}: no pair of methods differs at all."
    tests = zip(found.tukey, found.supplement.paired_t, strict=True)
    pairs = "; ".join(_pair_words(pair, _tested(pair, t, experiment, full=full)) for pair, t in tests)
    note = ", 95 % CIs simultaneous" if full else ""
    return f"{comparisons(planned=planned)} (Tukey's HSD{note}): {pairs}."


def comparisons(*, planned: bool) -> str:
    """What tests of all pairs are called; logs of other programs come without a plan."""
    return "Planned comparisons" if planned else "Comparisons of all pairs"


def _pair_words(pair: Pair, tested: str) -> str:
    """The larger mean first."""
    a, b = display_name(pair.a), display_name(pair.b)
    if math.isnan(pair.p):
        return f"{a} and {b} do not differ at all"
    if not pair.p < 0.05:
        return f"{a} and {b} did not differ significantly, {tested}"
    return f"{b} was above {a}, {tested}" if pair.difference < 0.0 else f"{a} was above {b}, {tested}"


def _tested(pair: Pair, t: PairedT, experiment: str, *, full: bool) -> str:
    """The p of a pair; `full`: after the size of the difference with its interval, before d_z."""
    if not full:
        return apa.p_value(pair.p)
    printed = PRINTED_MEASURES[experiment]
    low, high = (pair.ci_low, pair.ci_high) if pair.difference >= 0.0 else (-pair.ci_high, -pair.ci_low)
    size = "" if t.d_z is None else f", d_z = {apa.number(abs(t.d_z))}"
    amount = f"by {printed.difference(pair.difference)}, 95 % CI {printed.interval(low, high)}"
    return f"{amount}, {apa.p_value(pair.p, exact=True)}{size}"


def tukey_tables(found: WithinStatistics, experiment: str, *, planned: bool = True) -> tuple[Table, ...]:
    """The pairs with their simultaneous intervals; no table where nothing was tested."""
    if found.anova is None or not found.tukey or found.supplement is None:
        return ()
    printed = PRINTED_MEASURES[experiment]
    unit = f" ({printed.unit_of_differences.strip()})" if printed.unit_of_differences else ""
    rows = (
        (
            f"{display_name(c.a)} − {display_name(c.b)}",
            apa.number(printed.scale * c.difference, printed.digits),
            printed.interval(c.ci_low, c.ci_high),
            apa.number(c.q),
            apa.p_cell(c.p),
            apa.number(t.d_z),
        )
        for c, t in zip(found.tukey, found.supplement.paired_t, strict=True)
    )
    table = Table(
        caption=f"{comparisons(planned=planned)} of {printed.words}{unit}: Tukey's HSD, repeated-measures error term, "
        f"{found.anova.df[1]} degrees of freedom; d_z: mean difference over the SD of the differences",
        header=("Pair", "Difference", "95 % CI, simultaneous", "q", "p", "d_z"),
        rows=tuple(rows),
    )
    return (table,)


def within_caption(found: WithinStatistics) -> str:
    """What the within-subject intervals of a table are; empty where there are none."""
    if found.within_ci is None or found.supplement is None:
        return ""
    low, high = found.supplement.diagnostics.scale
    cut = any(ends.ci_low <= low or ends.ci_high >= high for ends in found.within_ci.values())
    return f". {_WITHIN}{_CUT if cut else ''}"


def _interval_cells(found: WithinStatistics, experiment: str, method: str) -> tuple[str, ...]:
    """The cell of a method's interval; none where no method has one."""
    ends: ConfidenceInterval | None = (found.within_ci or {}).get(method)
    return () if ends is None else (PRINTED_MEASURES[experiment].interval(ends.ci_low, ends.ci_high),)


def direction_means(found: DirectionStatistics) -> Table:
    """Rates of both directions, d′, criterion and response time."""
    interval = ("95 % CI, forward [%]",) if found.within_ci else ()
    spread = f" of {found.people}; median of the"
    if found.n > 1:
        spread = ": mean (SD) over participants, the SD of rates in percentage points; pooled median of the"
    return Table(
        caption=f"Correct rates, sensitivity d′ and criterion{spread} valid response times, and their number"
        f"{within_caption(found)}",
        header=("Method", "Forward", *interval, "Backward", "d′", "Criterion", "Response time [s]"),
        rows=tuple(_direction_row(found, method) for method in found.methods),
    )


def _direction_row(found: DirectionStatistics, method: str) -> tuple[str, ...]:
    backward, sensitivity = found.backward, found.sensitivity[method]
    time = found.response_time[method]
    measures = () if sensitivity is None else (sensitivity.d_prime, sensitivity.criterion)
    return (
        display_name(method),
        mean_sd(found.means[method], found.sds[method], 100.0, 1, " %"),
        *_interval_cells(found, "direction", method),
        mean_sd(backward.means.get(method), backward.sds.get(method), 100.0, 1, " %"),
        *((mean_sd(one.mean, one.sd, 1.0, 2, "") for one in measures) if measures else (apa.NO_NUMBER, apa.NO_NUMBER)),
        f"{apa.number(time.median)} ({time.n:,})" if time.n else apa.NO_NUMBER,
    )


def mean_sd(mean: float | None, sd: float | None, scale: float, digits: int, unit: str) -> str:
    """`mean unit (SD)`, the mean alone where one person has no SD; a dash for what is undefined."""
    if mean is None or math.isnan(mean):
        return apa.NO_NUMBER
    spread = "" if sd is None or math.isnan(sd) else f" ({apa.number(scale * sd, digits)})"
    return f"{apa.number(scale * mean, digits)}{unit}{spread}"


def binomial_table(found: DirectionStatistics) -> Table:
    """Each method and direction against guessing."""
    pooled = found.n > 1
    rows = (
        (
            display_name(method),
            direction,
            f"{test.successes} of {test.trials}",
            apa.percent(test.estimate),
            apa.interval(100.0 * test.ci_low, 100.0 * test.ci_high, 1),
            apa.p_cell(test.p),
            *((apa.p_cell(test.clustering.p_adjusted),) if pooled else ()),
        )
        for method, tests in found.binomial.items()
        for direction, test in tests.items()
    )
    trials = "trials pooled over participants; the last column takes into account that trials come in people"
    return Table(
        caption=f"Exact binomial tests against 50 %, {trials if pooled else f'trials of {found.people}'}",
        header=("Method", "Direction", "Correct", "Rate", "95 % CI [%]", "p", *(("p, clustered",) if pooled else ())),
        rows=tuple(rows),
    )


def preference_means(found: WithinStatistics) -> Table:
    """Mean, SD and within-subject interval of the ratings; the interval is left out where there is none."""
    printed, several = PRINTED_MEASURES["preference"], found.n > 1
    rows = (
        (
            display_name(m),
            apa.number(found.means[m], printed.digits),
            *((apa.number(found.sds[m], printed.digits),) if several else ()),
            *_interval_cells(found, "preference", m),
        )
        for m in found.methods
    )
    return Table(
        caption=f"Ratings of {found.people}{within_caption(found)}",
        header=("Method", *(("Mean", "SD") if several else ("Rating",)), *(("95 % CI",) if found.within_ci else ())),
        rows=tuple(rows),
    )


_DIRECTION_NOTE = (
    "The measure is the share of right answers on forward shots. Forward trials alone mix sensitivity with the "
    "readiness to say forward"
)
_BOTH_DIRECTIONS = (
    ", so d′ and criterion over both directions stand beside it (log-linear correction; a criterion below 0 leans "
    "towards forward)."
)
_ONE_DIRECTION = "; without backward trials nothing tells one from the other, so there is neither d′ nor criterion."


def direction_section(report: ReportData) -> Iterator[Section]:
    """Experiment 1: correct rates, sensitivity, planned comparisons, tests against guessing."""
    found = report.statistics.direction
    if found is None or not found.n:
        return
    note = _DIRECTION_NOTE + (_BOTH_DIRECTIONS if any(found.sensitivity.values()) else _ONE_DIRECTION)
    yield Section(
        title="Direction recognition",
        paragraphs=(
            note,
            " ".join([_binomial_sentence(found), *([found.binomial_note] * (found.n > 1))]),
            *pooled_setups(report.remarks, "direction"),
        ),
        pictures=(directions_picture(found),),
        tables=(
            direction_means(found),
            *tukey_tables(found, "direction", planned=report.planned),
            binomial_table(found),
        ),
    )


_OWN_SCALE = "Ratings went from 0 (dislike very much) to 10 (like very much)."


def preference_section(report: ReportData) -> Iterator[Section]:
    """Experiment 2: ratings and planned comparisons."""
    found = report.statistics.preference
    if found is None or not found.n:
        return
    yield Section(
        title="Preference",
        paragraphs=(
            _OWN_SCALE if report.rated_from is None else scale_of_others(report.rated_from),
            *pooled_setups(report.remarks, "preference"),
        ),
        tables=(preference_means(found), *tukey_tables(found, "preference", planned=report.planned)),
    )


def _binomial_sentence(found: DirectionStatistics) -> str:
    """Which rates differed from guessing."""
    tests = [
        (test.p < 0.05, f"{display_name(method)} {direction}, {apa.p_value(test.p)}")
        for method, directions in found.binomial.items()
        for direction, test in directions.items()
    ]
    if has_many(found):
        away = sum(significant for significant, _ in tests)
        told = f"of {len(tests)} rates {away} differed significantly from 50 %; the table has all"
        return f"Exact binomial tests of the correct rates: {told}."
    parts = list[str]()
    for differs, words in ((False, "no significant difference"), (True, "a significant one")):
        shown = "; ".join(text for significant, text in tests if significant is differs)
        difference = words if parts or not differs else "a significant difference"
        parts += [f"{difference} from 50 % ({shown})"] if shown else []
    return f"Exact binomial tests of the correct rates: {', and '.join(parts)}."


def everybodys_values(report: ReportData) -> Iterator[Section]:
    """The appendix' tables of each participant's values."""
    direction, preference = report.statistics.direction, report.statistics.preference
    tables = (
        *((_direction_people(direction),) if direction and direction.n else ()),
        *((_preference_people(preference),) if preference and preference.n else ()),
    )
    if tables:
        yield Section(title="Every participant's values", tables=tables, appendix=True, folded=True)


def _direction_people(found: DirectionStatistics) -> Table:
    """Forward and backward rate of each participant in one cell a method."""
    backward = found.backward.participants
    rows = tuple(
        (code, *(_both(row[m], backward.get(code, {}).get(m)) for m in found.methods)) for code, row in _few(found)
    )
    return _people_table(found, rows, "Correct rate of each participant, forward / backward", "direction_wide.csv")


def _both(forward: float | None, backward: float | None) -> str:
    return f"{apa.percent(forward, 0)} / {apa.percent(backward, 0)}"


def _preference_people(found: WithinStatistics) -> Table:
    """The rating of each participant."""
    rows = tuple((code, *(apa.number(row[m], 1) for m in found.methods)) for code, row in _few(found))
    return _people_table(found, rows, "Rating of each participant", "preference_wide.csv")


def _few(found: WithinStatistics) -> Iterator[tuple[str, Mapping[str, float]]]:
    """Everybody, or the first 50 of more than 100."""
    return islice(found.participants.items(), SHOWN if len(found.participants) > LISTED else None)


def _people_table(found: WithinStatistics, rows: tuple[tuple[str, ...], ...], caption: str, file: str) -> Table:
    rest = f": the first {len(rows)} of {found.n:,}; everybody is in {file}" if len(rows) < found.n else ""
    header = ("Participant", *(display_name(method) for method in found.methods))
    return Table(caption=caption + rest, header=header, rows=rows)
