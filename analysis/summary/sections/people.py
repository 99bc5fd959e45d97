"""The section that says who is in which analysis."""

from __future__ import annotations

from analysis.report.section import LISTED, SHOWN, Section, Table
from analysis.summary.participation import Participation, PeopleOfExperiment
from analysis.summary.sections.content import EXPERIMENTS

_HEADER = ("Experiment", "Analysed", "Left out", "Begun", "Not done", "Practices", "Set aside")
_MEANING = (
    "Begun: the run is not finished. Not done: known from the register or another experiment. Practices and runs that "
    "were set aside are counted and never analysed."
)


def people_section(found: Participation | None) -> Section | None:
    """Everybody whom logs, journals and registers know, in every experiment; who is missing by name."""
    if found is None or not found.experiments:
        return None
    counts = Table(
        caption="People in each analysis",
        header=_HEADER,
        rows=tuple((_named(name), *_counts(one)) for name, one in found.experiments.items()),
    )
    return Section(title="Who is in which analysis", paragraphs=(_MEANING,), tables=(counts, *_absent(found)))


def _counts(one: PeopleOfExperiment) -> tuple[str, ...]:
    counts = (one.analysed, one.left_out, one.begun, one.not_done, one.practices, one.set_aside)
    return tuple(f"{count:,}" for count in counts)


def _absent(found: Participation) -> tuple[Table, ...]:
    if not found.absent:
        return ()
    shown = found.absent if len(found.absent) <= LISTED else found.absent[:SHOWN]
    rest = len(found.absent) - len(shown)
    rows = [(one.participant, _named(one.experiment), one.state) for one in shown]
    rows += [("", "", f"and {rest:,} more, all in statistics.json")] if rest else []
    return (Table(caption="Who is missing in which", header=("Participant", "Experiment", "Why"), rows=tuple(rows)),)


def _named(experiment: str) -> str:
    return EXPERIMENTS.get(experiment, experiment).capitalize()
