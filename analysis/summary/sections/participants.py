"""Who was analysed and who was left out, and the lines on top of a report: nobody is to take simulations for people."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass

from analysis.logs.exclusions import FINISHED, IN_NO_TEST, LeftOut, by_rule
from analysis.logs.files import Problem, below, folder_above, name_below
from analysis.logs.measures import NOT_STATED
from analysis.report import apa
from analysis.report.section import LISTED, SHOWN, PageNotice, Section, Table
from analysis.summary.participation import PeopleOfExperiment
from analysis.summary.results import DesignSummary, Origin, WithinStatistics
from analysis.summary.sections.content import EXPERIMENTS, ReportData
from device.messages import first_few, how_many

_NAMED = 12
"""So many lines of who was left out stand on top, and so many people in a line; all are in the appendix."""
_HANDS = {
    "participant": "by the participant's own hand",
    "experimenter": "by the experimenter's hand",
    "synthetic": "by synthetic participants",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Analysed:
    """An experiment or design of a report: how many people are in it and how many not, and whose answers it has."""

    name: str
    people: PeopleOfExperiment
    origin: Origin


def analysed_parts(report: ReportData) -> Iterator[Analysed]:
    """The experiments, then the designs, then those that nobody has finished."""
    statistics = report.statistics
    own = {name: statistics.of(name) for name in EXPERIMENTS}
    experiments: dict[str, WithinStatistics | DesignSummary] = {
        name: found for name, found in (own | dict(statistics.designs)).items() if found is not None
    }
    known = statistics.participation.experiments if statistics.participation else {}
    left_out = Counter(entry.experiment for entry in statistics.excluded)
    for key in dict.fromkeys([*experiments, *known]):
        one = experiments.get(key)
        n = 0 if one is None else one.n
        alone = PeopleOfExperiment(analysed=n, left_out=left_out[key], begun=0, not_done=0)
        origin = Origin(answers={}, guns={}) if one is None else one.origin
        yield Analysed(name=_named(report, key), people=known.get(key, alone), origin=origin)


def _named(report: ReportData, experiment: str) -> str:
    design = report.statistics.designs.get(experiment)
    return design.title if design else EXPERIMENTS.get(experiment, experiment).capitalize()


def participants_section(report: ReportData) -> Iterator[Section]:
    """How many are in which analysis and how many not, whose answers they are, and who was left out, with the rule."""
    parts, gone = tuple(analysed_parts(report)), left_out_lines(report)
    rest = f"and {len(gone) - _NAMED:,} more, listed in the appendix"
    nothing = () if any(one.people.analysed for one in parts) else ("There was nothing to analyse.",)
    yield Section(
        title="Who was analysed",
        paragraphs=nothing,
        tables=(_people_table(report, parts),) if parts else (),
        items=gone if len(gone) <= _NAMED else (*gone[:_NAMED], rest),
    )


_STATES = {
    "Left out": "left_out",
    "Begun": "begun",
    "Not done": "not_done",
    "Practices": "practices",
    "Set aside": "set_aside",
}
_MEANINGS = {
    "Begun": "Begun: the run is not finished",
    "Not done": "not done: known from the register or another experiment",
    "Practices": "practices and runs set aside are counted and never analysed",
}


def _people_table(report: ReportData, parts: tuple[Analysed, ...]) -> Table:
    """The counts, those that are all 0 left away but for who was left out."""
    counts = {head: [getattr(one.people, name) for one in parts] for head, name in _STATES.items()}
    shown = [head for head, column in counts.items() if any(column) or head == "Left out"]
    files = f" of {how_many(len(report.files), 'log file')}" if report.files else ""
    meanings = "; ".join(text for head, text in _MEANINGS.items() if head in shown)
    return Table(
        caption=f"Participants, answers and trials{files}{f'. {meanings}' if meanings else ''}",
        header=("Experiment", "Analysed", *shown, "Answers", "Trials"),
        rows=tuple(
            (
                *(one.name, f"{one.people.analysed:,}", *(f"{counts[head][place]:,}" for head in shown)),
                *(_answers(one.origin), _guns(one.origin)),
            )
            for place, one in enumerate(parts)
        ),
    )


def _answers(origin: Origin) -> str:
    return ", ".join(f"{count:,} {_HANDS.get(hand, hand)}" for hand, count in origin.answers.items()) or apa.NO_NUMBER


def _guns(origin: Origin) -> str:
    return ", ".join(f"{count:,} {_on(gun)}" for gun, count in origin.guns.items()) or apa.NO_NUMBER


def _on(gun: str) -> str:
    """On what trials were rendered, by the name that logs give.

    >>> _on("RG-2:0007"), _on("pneumatic gun"), _on("not stated")
    ('on the gun RG-2:0007', 'on pneumatic gun', 'on a gun that the logs do not name')
    """
    if gun == "simulated":
        return "on the simulated gun"
    if gun == NOT_STATED:
        return "on a gun that the logs do not name"
    return f"on {gun}" if "gun" in gun.lower().split() else f"on the gun {gun}"


def all_left_out(report: ReportData) -> Iterator[Section]:
    """The appendix' list of who and what was left out where it is too long for the top, and who is missing in which."""
    gone, tables = left_out_lines(report), tuple(_absent_people(report))
    rest = f"{len(gone) - SHOWN:,} more, all in statistics.json: who was left out under “excluded”, the rest under "
    every = gone if len(gone) <= LISTED else (*gone[:SHOWN], f"and {rest}“log_remarks”")
    listed = every if len(gone) > _NAMED else ()
    if listed or tables:
        title = "Everybody and everything left out"
        yield Section(title=title, items=listed, tables=tables, appendix=True, folded=True)


def _absent_people(report: ReportData) -> Iterator[Table]:
    found = report.statistics.participation.absent if report.statistics.participation else ()
    shown = found if len(found) <= LISTED else found[:SHOWN]
    rows = [(one.participant, _named(report, one.experiment), one.state) for one in shown]
    rows += (
        [("", "", f"and {len(found) - len(shown):,} more, all in statistics.json")] if len(shown) < len(found) else []
    )
    if rows:
        yield Table(caption="Who is missing in which", header=("Participant", "Experiment", "Why"), rows=tuple(rows))


def left_out_lines(report: ReportData) -> tuple[str, ...]:
    """A line a rule with everybody whom it leaves out, a line a file that could not be used, or of which there is more.

    What could not be read is told by its file.
    """
    people = [entry for entry in report.statistics.excluded if not entry.file or entry.rule == FINISHED]
    root = shown_root(report) if report.problems or report.remarks else ""

    def told(problem: Problem) -> str:
        return below(problem, name_below(problem.file, root).parent)

    return (
        *(_rule_line(report, some) for some in by_rule(people)),
        *(f"Left out: {told(problem)}." for problem in report.problems),
        *(f"{'Used, but' if _is_used(report, remark) else 'Also'}: {told(remark)}." for remark in report.remarks),
    )


def _is_used(report: ReportData, remark: Problem) -> bool:
    """Whether what there is to say is of logs that count: of whoever is left out, the reason stands above."""
    analysed = report.analysed.get(remark.experiment, ())
    return not remark.participant or any(code.rpartition("/")[2] == remark.participant for code in analysed)


def _rule_line(report: ReportData, entries: list[LeftOut]) -> str:
    first = entries[0]
    people = first_few([f"{entry.participant} ({entry.reason})" for entry in entries], _NAMED)
    people += ", all in statistics.json" if len(entries) > _NAMED else ""
    rule = f" Rule: {first.rule}." if first.rule else ""
    remedy = f" Remedy: {first.remedy}." if first.remedy else ""
    count, tests = how_many(len(entries), "participant"), " of tests" if first.rule == IN_NO_TEST else ""
    return f"{_named(report, first.experiment)}: {count} left out{tests}: {people}.{rule}{remedy}"


def shown_root(report: ReportData) -> str:
    """The folder below which files are named on the page: nothing of the machine."""
    return folder_above([*report.files, *(one.file for one in (*report.problems, *report.remarks))])


def notices(report: ReportData) -> Iterator[PageNotice]:
    """The lines on top: whose answers these are, on which gun, and where one person is alone."""
    parts = [one for one in analysed_parts(report) if one.people.analysed]
    answers, guns = Counter[str](), Counter[str]()
    for one in parts:
        answers.update(one.origin.answers)
        guns.update(one.origin.guns)
    synthetic, people = answers["synthetic"], answers.total() - answers["synthetic"]
    if synthetic:
        yield PageNotice(text=_synthetic(synthetic, people, report), kind="warning")
    elif people:
        yield _of_people(people, guns)
    alone = [one.name.lower() for one in parts if one.people.analysed == 1]
    if alone:
        text = f"ONE PARTICIPANT in {' and '.join(alone)}: a person is described, no condition tested against another."
        yield PageNotice(text=text, kind="warning")


def _synthetic(synthetic: int, people: int, report: ReportData) -> str:
    if people:
        return (
            f"SYNTHETIC AND REAL DATA TOGETHER: {synthetic:,} of {synthetic + people:,} answers are those of simulated "
            "participants. What is computed from both is evidence of nothing."
        )
    if report.reconstructed:
        return (
            "SYNTHETIC DATA: the answers were rebuilt from the published numbers, and so give these back. That checks "
            "the analysis; it replicates nothing and is no evidence about people."
        )
    return "SYNTHETIC DATA: simulated participants answered. Nothing here is evidence about people."


def _of_people(people: int, guns: Counter[str]) -> PageNotice:
    if guns["simulated"]:
        text = (
            f"SIMULATED GUN: {guns['simulated']:,} of {guns.total():,} trials were rendered by no gun, so nobody felt "
            f"anything in them; the {how_many(people, 'answer')} are of people."
        )
        return PageNotice(text=text, kind="warning")
    real = f" {', '.join(map(_on, sorted(guns)))}" if guns else "; the logs name no gun"
    return PageNotice(text=f"{how_many(people, 'answer')} of people{real}.", kind="note")
