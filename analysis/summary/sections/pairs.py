"""Paired comparison in a report: scores of both models, and how consistent people's choices are."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from analysis.psychometric.paired import ItemScore
from analysis.report import apa
from analysis.report.labels import display_name
from analysis.report.section import LISTED, SHOWN, Picture, Section, Table
from analysis.summary.figures.pairs import has_scores
from analysis.summary.pairs import PairCondition, PairedComparison
from analysis.summary.question_results import QuestionSummary
from analysis.summary.results import DesignSummary
from analysis.summary.sections.pictures import pairs_figure_of
from device.messages import first_few
from experiments.design.language import Level
from experiments.design.methods_section import factor_words

_TOLD = 6


def pair_sections(name: str, found: DesignSummary) -> Iterator[Section]:
    """A section for each question about pairs."""
    for asked, question in found.questions.items():
        if question.pairs is not None:
            yield _section(name, asked, found, question.pairs)


def pair_sentences(found: DesignSummary, question: QuestionSummary) -> Iterator[str]:
    """The scores by Bradley and Terry, in a sentence for each condition; why there are none."""
    of = question.pairs
    for condition in () if of is None else of.conditions[:_TOLD]:
        scores, where = condition.scores[0], _condition(found, condition.levels)
        if scores.reason:
            yield f"No scores{where}: {scores.reason}."
        elif of is not None:
            told = [
                f"{_item(found, of, str(one.item))} {apa.number(one.score)} {apa.interval(one.low, one.high)}"
                for one in scores.scores
            ]
            yield f"Scores by Bradley and Terry{where} (logits): {first_few(told, _TOLD)}."


def _section(name: str, asked: str, found: DesignSummary, of: PairedComparison) -> Section:
    title = f"{(found.title or name.capitalize()).rstrip('.?!')}: paired comparison, {asked}"
    if of.reason:
        return Section(title=title, paragraphs=(f"No scores: {of.reason}.",))
    caption = (
        f"{found.title.rstrip('.?!')}, {asked}: scores by Bradley and Terry with 95 % intervals; dashed: the mean of "
        "all."
    )
    alt = " ".join(pair_sentences(found, found.questions[asked]))
    shown = Picture(stem=pairs_figure_of(name, asked), caption=caption, alt=f"Scores with intervals. {alt}")
    return Section(
        title=title,
        paragraphs=(_WHAT, *_ties(of), *_without(found, of), *_circles_words(found, of)),
        pictures=(shown,) if has_scores(of) else (),
        tables=tuple(_tables(asked, found, of)),
    )


_WHAT = (
    "Each item has one score, and how often it is chosen over another follows from their difference alone: by Bradley "
    "and Terry in logits, P = 1 / (1 + exp(b − a)); by Thurstone's case V in standard deviations of a difference, "
    "P = Φ(a − b). Scores sum to 0. Intervals are the wider of two: of independent answers, and of a sandwich over "
    "people, which allows for people who differ."
)


def _ties(of: PairedComparison) -> Iterator[str]:
    ties = sum(sum(map(sum, condition.ties)) for condition in of.conditions) // 2
    if ties:
        yield f"{ties:,} answers were ties, as Davidson (1970) and Glenn and David (1960) have them in the models."


def _without(found: DesignSummary, of: PairedComparison) -> Iterator[str]:
    for condition in of.conditions:
        if reason := condition.scores[0].reason:
            yield f"No scores{_condition(found, condition.levels)}: {reason}."


def _circles_words(found: DesignSummary, of: PairedComparison) -> Iterator[str]:
    for condition in of.conditions:
        circular = sum(one.circles.circular for one in condition.participants)
        triads = sum(one.circles.triads for one in condition.participants)
        if triads:
            yield (
                f"Circular triads (A over B over C over A){_condition(found, condition.levels)}: {circular:,} of "
                f"{triads:,} whose three pairs were decided, {apa.percent(circular / triads)}; of choices at random it "
                "is 25 %."
            )


def _condition(found: DesignSummary, levels: Mapping[str, Level]) -> str:
    return f" with {found.condition(levels, display_name)}" if levels else ""


def _item(found: DesignSummary, of: PairedComparison, shown: str) -> str:
    level = next((one for one in of.items if str(one) == shown), shown)
    return display_name(found.label(of.factor, level))


def _tables(asked: str, found: DesignSummary, of: PairedComparison) -> Iterator[Table]:
    for condition in of.conditions:
        where = _condition(found, condition.levels)
        if condition.scores[0].scores:
            yield _scores(f"{asked}: scores{where}", found, of, condition)
        if condition.participants:
            yield _circles(f"{asked}: circular triads by participant{where}", condition)


def _scores(caption: str, found: DesignSummary, of: PairedComparison, condition: PairCondition) -> Table:
    one, other = condition.scores
    thurstone = other.scores or (None,) * len(one.scores)
    tied = any(map(any, condition.ties))
    words = factor_words(of.factor)
    return Table(
        caption=caption,
        header=(
            f"{words[:1].upper()}{words[1:]}",
            "Chosen",
            *(["Tied"] if tied else []),
            "Of",
            "Bradley–Terry",
            "95 % interval",
            "Thurstone V",
            "95 % interval",
        ),
        rows=tuple(
            (
                _item(found, of, str(first.item)),
                f"{sum(condition.wins[place]):,}",
                *([f"{sum(condition.ties[place]):,}"] if tied else []),
                f"{_compared(condition, place):,}",
                apa.number(first.score),
                apa.interval(first.low, first.high),
                *_of_other(second),
            )
            for place, (first, second) in enumerate(zip(one.scores, thurstone, strict=True))
        ),
    )


def _of_other(score: ItemScore | None) -> tuple[str, str]:
    if score is None:
        return apa.NO_NUMBER, apa.NO_NUMBER
    return apa.number(score.score), apa.interval(score.low, score.high)


def _compared(condition: PairCondition, place: int) -> int:
    """How often an item was compared with another."""
    lost = sum(row[place] for row in condition.wins)
    return sum(condition.wins[place]) + lost + sum(condition.ties[place])


def _circles(caption: str, condition: PairCondition) -> Table:
    rows = tuple(
        (one.participant, str(one.circles.triads), str(one.circles.circular), apa.number(one.circles.zeta))
        for one in condition.participants
    )
    cut = len(rows) > LISTED
    kept = f" (the first {SHOWN} of {len(rows):,})" if cut else ""
    return Table(
        caption=f"{caption}{kept}; ζ = 1: no circles",
        header=("Participant", "Triads decided", "Circular", "Consistency ζ"),
        rows=rows[:SHOWN] if cut else rows,
    )
