"""How participants stand, in the sentences of the start window."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from pathlib import Path

from experiments.clock import date_text
from experiments.record.names import is_code
from experiments.screens.phrases import phrase
from experiments.screens.texts import doubt_text
from experiments.study.enrolment import Entered, code_doubt, left_to_do, passed_over, run_of
from experiments.study.folders import Overview, PlaceError, StudyFolder, refuse_gone
from experiments.study.study import Participant, RunProgress, why_nobody

_CELL = {"done": "done", "not begun": "–", "unreadable": phrase("cannot be read"), "synthetic": "synthetic"}


def cell_text(run: RunProgress) -> str:
    """A run in the table of participants."""
    how = phrase("practice done, too little right") if run.practice_missed else phrase("practice done")
    practice = [how] if run.practised else []
    if run.state in _CELL:
        return "\n".join([_CELL[run.state], *practice])
    counts = phrase(", {answered} of {planned}", answered=run.answered, planned=run.planned) if run.planned else ""
    return "\n".join([f"{run.state}{counts}", *([date_text(run.last_utc)] if run.last_utc else []), *practice])


def note_text(person: Participant) -> str:
    """What the table says of somebody beside their runs."""
    if person.excluded is not None:
        return phrase("excluded: {excluded}", excluded=person.excluded)
    return "" if person.left is None else phrase("comes no more: {left}", left=person.left)


def stopped_text(code: str, run: RunProgress) -> str:
    """When an unfinished run stopped, and how far it had come."""
    when, counts = (
        date_text(run.last_utc),
        phrase("{answered} of {planned}", answered=run.answered, planned=run.planned),
    )
    spoken = phrase(", in {language}", language=run.language) if run.language else ""
    return phrase(
        "{code} stopped {experiment} on {when} with {counts} trials answered{spoken}.",
        code=code,
        experiment=run.experiment,
        when=when,
        counts=counts,
        spoken=spoken,
    )


def coming_text(seen: Overview) -> str:
    """Who comes next."""
    if seen.next is not None:
        new = phrase(" (new)") if seen.next.new else ""
        return phrase(
            "Next: {participant_id}{new}, {experiment}",
            participant_id=seen.next.participant_id,
            new=new,
            experiment=" and ".join(run.experiment for run in seen.next.runs),
        )
    match why_nobody(seen.participants):
        case "unreadable", _:
            return phrase("Nobody can be named next: see what cannot be read.")
        case "elsewhere", codes:
            return phrase("Nobody waits; at another console now: {elsewhere}.", elsewhere=", ".join(codes))
        case _:
            return phrase("Everyone has done everything.")


def changed_text(seen: Overview) -> str:
    """That the study is not as it was frozen; what was edited or is missing is among its problems."""
    last, changed = seen.frozen.chain.last, len(seen.frozen.changes)
    if last is None or not changed:
        return ""
    keys = phrase("1 key or file has") if changed == 1 else phrase("{changed} keys or files have", changed=changed)
    return phrase(
        "{keys} changed since {title}; `recoil study` names them, and the report will.", keys=keys, title=last.title
    )


def named_text(named: str, code: str, person: Participant | None, experiment: str) -> str:
    """Why another experiment is chosen than the one that was named when the program was started."""
    if not code or named in ("", experiment):
        return ""
    if person is not None and run_of(person, named).state == "done":
        return phrase(
            "{named} was named, but {code} has done it: {experiment} is chosen.",
            named=named,
            code=code,
            experiment=experiment,
        )
    return phrase(
        "{named} was named, but {code} comes to {experiment} first: {experiment} is chosen.",
        named=named,
        code=code,
        experiment=experiment,
    )


def remark_of_choice(entered: Entered, study: StudyFolder, seen: Overview, had: Collection[Path]) -> tuple[str, str]:
    """As `remark`, of who is chosen in a study; before it that their files are gone, or that the code is in doubt."""
    code = entered.participant_id
    try:
        refuse_gone(study.results, had, code)
    except PlaceError as error:
        return str(error), "bad"
    known = {one.participant_id: one for one in seen.participants}
    doubt = code_doubt(code, [*known], study.config.code_prefix)
    return (doubt_text(doubt), "ask") if doubt else remark(code, known.get(code), entered.experiment, study.experiments)


def remark(code: str, person: Participant | None, experiment: str, experiments: Sequence[str]) -> tuple[str, str]:
    """What there is to know before somebody does an experiment, and a word that chooses the colour."""
    return next(_remarks(code, person, experiment, experiments))


def _remarks(
    code: str, person: Participant | None, experiment: str, experiments: Sequence[str]
) -> Iterator[tuple[str, str]]:
    """What could be said, the most important first."""
    if not code:
        yield phrase("Who comes? Choose them in the table, or type a code."), "act"
        return
    if person is not None:
        yield from _hindrances(person, experiment, experiments)
    before = passed_over(person, experiment, experiments)
    if before:
        first = " and ".join(before)
        yield (
            phrase(
                ("Order broken: {first} comes before {experiment} in this study, and {code} has not done it."),
                first=first,
                experiment=experiment,
                code=code,
            ),
            "ask",
        )
    if person is None:
        yield (
            (phrase("{code} is new.", code=code), "good")
            if is_code(code)
            else (phrase("{code} is no code: 1 to 32 letters and digits (A-Z, a-z, 0-9).", code=code), "bad")
        )
    else:
        yield _progress(person, experiment), "good"


def _hindrances(person: Participant, experiment: str, experiments: Sequence[str]) -> Iterator[tuple[str, str]]:
    code, run = person.participant_id, run_of(person, experiment)
    if person.excluded is not None:
        yield phrase("{code} is excluded: {excluded}.", code=code, excluded=person.excluded), "bad"
    elif person.left is not None:
        yield phrase("{code} comes no more: {left}.", code=code, left=person.left), "bad"
    if person.is_elsewhere:
        yield phrase("{code} sits at another console.", code=code), "bad"
    if run.state == "unreadable":
        yield phrase("The journal of {code}'s {experiment} cannot be read.", code=code, experiment=experiment), "bad"
    if run.state == "done":
        left = left_to_do(person, experiments)
        yield phrase("{code} has done {done}.", code=code, done=experiment if left else phrase("everything")), "bad"


def _progress(person: Participant, experiment: str) -> str:
    code, run = person.participant_id, run_of(person, experiment)
    if run.state == "synthetic":
        return phrase(
            ("A synthetic participant did {experiment} as {code}; that run is set aside when {code} begins."),
            experiment=experiment,
            code=code,
        )
    if run.state == "in progress":
        return stopped_text(code, run)
    done = [one.experiment for one in person.runs if one.state == "done"]
    return (
        phrase("{code} has done {done}.", code=code, done=" and ".join(done))
        if done
        else phrase("{code} has not begun.", code=code)
    )
