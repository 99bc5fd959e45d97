"""The run that stands where another one is to be: it is gone on with, or gives way, or is in the way and says so."""

from __future__ import annotations

import json
import os
import shlex
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import asdict, dataclass, replace
from heapq import nlargest
from typing import TYPE_CHECKING

from device import Gun, Identity
from experiments.catalogues.catalogue import ENGLISH, Language, language
from experiments.catalogues.messages import placeholders
from experiments.clock import Clock, date_text
from experiments.config.door import ConfigError
from experiments.design.plan import Plan
from experiments.design.shown_texts import setup_in
from experiments.record.journal import (
    Contents,
    JournalError,
    ShownLanguage,
    begun,
    hold_journal,
    journal_bytes,
    read_journal,
)
from experiments.record.journal import head as journal_head
from experiments.record.names import Place
from experiments.record.owed_shot import owed_shots
from experiments.record.replay import answers_in, history, is_shot, last_word_on_gun
from experiments.record.tables import is_simulated
from experiments.run_request import RunRequest
from experiments.session.steps import Answered
from experiments.study import folders, register
from experiments.study.changes import changes_told, people_changes, setup_changes
from experiments.study.folders import RETEST, PlaceError

if TYPE_CHECKING:
    from pathlib import Path


class UnfinishedRun(PlaceError):  # noqa: N818 - what is there, not what went wrong
    """An unfinished run is there; the message says when it stopped, and that it takes a decision."""

    def __init__(self, where: Place, contents: Contents) -> None:
        last = contents.records[-1]
        super().__init__(
            f"participant {where.participant_id} has an unfinished run of {where.experiment}, stopped at "
            f"{date_text(last.utc)} after record {last.n}: {where.journal}; "
            "--resume goes on with it, --fresh --reason TEXT sets it aside and starts anew"
        )
        self.where, self.contents = where, contents


class NotAsItBegan(PlaceError):  # noqa: N818 - what is there, not what went wrong
    """An unfinished run that does not go on with what there is now; `refusal` says why, and what it goes on with.

    With which `option` that is given, and how to start anew, the message says for a command line; a window has a button
    to start anew.
    """

    def __init__(self, journal: Path, refusal: str, option: str = "") -> None:
        self.refusal = f"{journal}: {refusal}"
        super().__init__(f"{self.refusal}{f' ({option})' if option else ''}, or start anew (--fresh)")


@dataclass(frozen=True, slots=True, kw_only=True)
class EarlierRun:
    """What stands where a run is to be: a run to go on with, or one that gives way to a new one, for a reason.

    `size_bytes`: of the journal as it was looked at.
    """

    before: Contents | None = None
    gives_way: bool = False
    reason: str = ""
    size_bytes: int = 0


def earlier_run(where: Place, request: RunRequest) -> EarlierRun:
    """What stands there. Nothing is moved yet: the gun, the sensor or the plan may be refused."""
    if not where.journal.exists():
        return EarlierRun()
    contents = _read(where, request)
    if contents is not None and _gives_way(contents, request):
        return EarlierRun(gives_way=True, reason=GAVE_WAY, size_bytes=_size_of_held(where))
    _refuse_finished(where, contents)
    size_bytes = _size_of_held(where)  # refused while another run is at it
    if contents is not None and not _is_anew(request):
        if request.again == "ask":
            raise UnfinishedRun(where, contents)
        return EarlierRun(before=contents)
    if contents is not None and contents.head.participant == "person" and (said := _said_in(where, contents)):
        _refuse_unsaid(request, said)
    return EarlierRun(gives_way=True, reason=request.anew_reason, size_bytes=size_bytes)


def _is_anew(request: RunRequest) -> bool:
    return request.again == "fresh" or request.practice


def _read(where: Place, request: RunRequest) -> Contents | None:
    """What a run has written; `None` if that is nothing, or cannot be read and is to be set aside."""
    try:
        contents = begun(where.journal)
    except JournalError as error:
        if not _is_anew(request):
            raise
        _refuse_unsaid(request, str(error))
        return None
    if contents is not None:
        folders.check_whose(where, contents.plan)
    return contents


def _refuse_unsaid(request: RunRequest, what: str) -> None:
    """`PlaceError`: what may be a person's answers is set aside, and nobody says why."""
    if not (request.practice or request.anew_reason):
        raise PlaceError(f"{what}; --fresh sets them aside, so say why with --reason TEXT")


def _said_in(where: Place, contents: Contents) -> str:
    """How many answers a run has, or why nobody can say; empty if it has none."""
    try:
        count = answers_in(contents)
    except JournalError as error:
        return str(error)
    return f"{where.journal}: has answers: {count}" if count else ""


def _size_of_held(where: Place) -> int:
    """How long a journal is that no other run is at. `JournalError`, if one is."""
    descriptor = hold_journal(where.journal)
    try:
        return os.fstat(descriptor).st_size
    finally:
        os.close(descriptor)


GAVE_WAY = "a synthetic run, which gave way to a person's"


def _gives_way(contents: Contents, request: RunRequest) -> bool:
    """Whether a synthetic run stands where a person comes to: it does not use up their place."""
    synthetic = contents.head.participant == "synthetic"
    return synthetic and not request.simulated and not request.practice and request.again != "resume"


def give_way(where: Place, earlier: EarlierRun, clock: Clock) -> None:
    """Set aside what stands there, with the reason on record before anything is moved.

    `JournalError` if it is not what was looked at any more: another run is at it, went on with it or took its place.
    """
    if _size_of_held(where) != earlier.size_bytes:
        raise JournalError(f"{where.journal}: another run wrote to it just now; look again and start anew")
    if earlier.reason:
        one = register.entry("set-aside", where.participant_id, experiment=where.experiment, reason=earlier.reason)
        register.append(where.results, one, clock)
    folders.set_aside(where)


def _refuse_finished(where: Place, contents: Contents | None) -> None:
    if contents is not None and contents.finished and not where.practice:
        raise PlaceError(
            f"participant {where.participant_id} has finished {where.experiment}: {where.journal}; "
            f"one finished run a participant and experiment; {RETEST}"
        )


def check_resumable(request: RunRequest) -> None:
    """`PlaceError` if there is nothing to go on with: a mistyped code is not to begin a run."""
    where = folders.place(request.results, request.participant_id, request.setup.config.experiment)
    if not where.journal.exists():
        raise PlaceError(
            f"{where.journal}: there is no run of {where.experiment} by {where.participant_id} to resume here; "
            "look at --participant and --results, or leave out --resume to begin one"
        )
    _check_same_answerer(request, where)


def _check_same_answerer(request: RunRequest, where: Place) -> None:
    """`PlaceError` if a synthetic participant would go on for a person, or a person for a synthetic one."""
    contents = begun(where.journal)
    if contents is None:
        return
    hands = [word.by for _, word in history(contents) if isinstance(word, Answered)]
    if {one == "synthetic" for one in (contents.head.participant, *hands)} != {request.simulated}:
        whose, other = (
            ("a person's", "a synthetic participant") if request.simulated else ("a synthetic participant's", "you")
        )
        raise PlaceError(
            f"{where.journal}: this run is {whose} so far, and {other} would go on with it; choose the screen "
            "that it began at, or another participant"
        )


def resumed_plan(before: Contents, request: RunRequest, gun: Gun) -> Plan:
    """The plan of the run to go on with. `PlaceError` if files, seed or kind of gun are not those it began with."""
    _check_same_files(before, request)
    plan = before.plan
    _check_same_language(before, request)
    _check_same_kind_of_gun(before, gun)
    if request.seed is not None and request.seed != plan.seed:
        raise PlaceError(f"{before.path}: the run began with seed {plan.seed}, not {request.seed}; leave out --seed")
    return plan


def _check_same_files(before: Contents, request: RunRequest) -> None:
    """`PlaceError` names the keys of config, gun or synthetic people that are not as the run began with them."""
    setup, head = request.setup, before.head
    given_back = f"`recoil configs --from {shlex.quote(str(before.path))} --copy DIR`"
    if changes := setup_changes(head.setup_json, setup.record(), (setup.source.name, setup.config.gun)):
        raise NotAsItBegan(
            before.path,
            f"the run began with another config or gun file: {changes_told(changes)}; "
            f"resume with the files it began with, which {given_back} gives back",
        )
    if request.simulated and (changes := people_changes(head.laws_json, setup)):
        raise NotAsItBegan(
            before.path,
            f"the run began with other synthetic people than there are now: {changes_told(changes)}; "
            f"resume with those it began with, whom {given_back} gives back",
        )


def _check_same_kind_of_gun(before: Contents, gun: Gun) -> None:
    """`PlaceError` if a run would be felt in part: it began on a gun and goes on without one, or on one after."""
    began = before.head.gun
    if began is not None and is_simulated(began.name) != is_simulated(gun.identify().name):
        raise NotAsItBegan(
            before.path,
            f"the run began on {began.name}, and the gun is {gun.identify().name} now: one of them is simulated, where "
            "nothing is felt; resume with the gun it began with",
            "--gun",
        )


UNMEASURED = (
    "A sensor measured this run until now, and none is named any more: from here on shots are not measured. If they "
    "are to be, stop, and resume with the sensor."
)

UNMASKED = (
    "Masking noise was asked for in this run until now, and is not any more: from here on the participant hears the "
    "room. If it is to play, stop, and resume with the noise."
)

LEFT_OUT = {
    "participant_screen": (
        "The participant had a screen of their own in this run until now, and has none any more: from here on the "
        "experimenter enters what they say. If they are to have it, stop, and resume with their screen."
    ),
    "participant_keys": (
        "The participant had keys of their own in this run until now, and has none any more: from here on no response "
        "time is theirs. If they are to have them, stop, and resume with their keys."
    ),
    "noise": UNMASKED,
}
"""What is said where the participant has no more what they had."""


def what_changed(before: Contents | None, request: RunRequest, gun: Gun) -> Iterator[str]:
    """What is not as it was until a run broke off, and does not forbid to go on: it is said, and noted in the run."""
    if before is None:
        return
    if not request.sensor and any(record.kind == "measured" for record in before.records):
        yield UNMEASURED
    began = next((record for record in reversed(before.records) if record.gun is not None), before.head)
    yield from (LEFT_OUT[name] for name, has in request.options.named if getattr(began, name) and not has)
    was, now = gun_felt_last(before), gun.identify()
    if was is not None and was != now:
        yield (
            f"The gun was {_who(was)} until now, and is {_who(now)} from here on. If it is to be the same one, stop, "
            "and resume with the gun it had."
        )


def gun_felt_last(contents: Contents) -> Identity | None:
    """The gun that fired last; until one did, that of the beginning. On one that was only opened nothing was felt."""
    last = gun = contents.head.gun
    for record in contents.records:
        gun = record.gun or gun
        if is_shot(record):
            last = gun
    return last


def way_back_to_gun(journal: Path, address: str) -> str:
    """The option that resumes a run with the gun it has: an address, if what is there now fired last or began it."""
    if address == "simulated":
        return ""
    with suppress(JournalError):
        contents = begun(journal)
        had = contents and gun_felt_last(contents)
        if contents and had and had != next(filter(None, (record.gun for record in reversed(contents.records))), None):
            return f" and --gun for {_who(had)}, as nothing was felt on the other yet"
    return f" --gun {shlex.quote(address)}"


def _who(gun: Identity) -> str:
    return f"{gun.name} (version {gun.version})"


def words_shown(request: RunRequest) -> tuple[dict[str, str], dict[str, str]] | None:
    """The messages of a run, and what it shows for the texts of its design; `None` where it is English alone."""
    _, texts = setup_in(request.language, request.setup)
    return None if request.language is ENGLISH else (asdict(request.language.messages), texts)


def _check_same_language(before: Contents, request: RunRequest) -> None:
    """`PlaceError` if the run began in another language, or in other words of it: it was shown so up to here.

    A message that the version of Recoil did not have that began it was not shown, and one that is gone is not any more.
    """
    began, now = before.head.language, request.language
    code = ENGLISH.code if began is None else began.code
    if code != now.code:
        raise PlaceError(f"{before.path}: the run began in {code}, not in {now.code}; resume with --language {code}")
    shown = () if began is None else zip((began.messages, began.texts), words_shown(request) or ({}, {}), strict=True)
    if any(was[name] != now[name] for was, now in shown for name in was.keys() & now.keys()):
        raise NotAsItBegan(
            before.path,
            f"the run began with another catalogue {code} than there is now; resume with the one it began with",
            "--catalogues DIR",
        )


def language_begun_in(request: RunRequest) -> ShownLanguage | None:
    """The language of the run that is there, by its journal; `None` where it is English, or nothing is on record."""
    journal = _journal_of(request)
    head = journal_head(journal) if journal.exists() else None
    return None if head is None else head.language


def _journal_of(request: RunRequest) -> Path:
    return folders.place(request.results, request.participant_id, request.setup.config.experiment).journal


def gone_on_with(request: RunRequest) -> RunRequest:
    """A request that goes on with a run, in that run's language: that it may be used was said when the run began.

    Raises as `begun_language`.
    """
    if request.again != "resume":
        return request
    began = language_begun_in(request)
    return replace(request, language=ENGLISH if began is None else begun_language(request, began))


def begun_language(request: RunRequest, began: ShownLanguage) -> Language:
    """The language that a run began in, in the words that it began in, whatever its catalogue has by now.

    `NotAsItBegan`, if its catalogue is not there any more, with what the journal does not hold.
    """
    try:
        now = language(began.code, request.catalogues, asked=f"the run began in {began.code}")
    except ConfigError as error:
        why = f"{error}; resume with the catalogue it began with"
        raise NotAsItBegan(_journal_of(request), why, "--catalogues DIR") from error
    known = asdict(now.messages)
    shown = {
        name: text
        for name, text in began.messages.items()
        if name in known and placeholders(text) == placeholders(known[name])
    }
    return replace(
        now,
        messages=replace(now.messages, **shown),
        look_up=lambda text: began.texts.get(text) or now.look_up(text),
    )


LOOKED_BACK = 1000
"""So many journals, the last that were written, are looked at for what came before on a gun."""
_OF_GUN = 20
"""So many of them, that name the gun, are read."""


def begins_halted(where: Place, before: Contents | None, gun: str) -> bool:
    """Whether the last that a participant had in their hand ended by an emergency stop, or the last on the gun.

    Practices and runs set aside are such too, and so is a run that began with the same debt and ended before it was
    paid, and a test shot beside all runs. What is done next begins with a test shot, then. `before`: what their own
    journal holds, where they go on.
    """
    own = [] if before is None else [before]
    for path in where.folder.glob("*_journal*.jsonl"):
        with suppress(JournalError):  # one that cannot be read is named where it is to be used
            own += [] if path == where.journal else [read_journal(path)]
    if max(map(last_word_on_gun, own), default=("", False))[1]:
        return True
    if is_simulated(gun):
        return False
    mine = [] if before is None else [last_word_on_gun(before, gun)]
    return max([*mine, *_words_on(gun, where.results, where.journal)], default=("", False))[1]


def owes_shot(results: Path, address: str) -> bool:
    """Whether an emergency stop beside all runs left a gun at an address a test shot that it still owes."""
    owed = [one for one in owed_shots(results) if one.address in ("", address)]
    return any(not one.gun or max(_words_on(one.gun, results), default=("", False))[1] for one in owed)


def _words_on(gun: str, results: Path, own: Path | None = None) -> Iterator[tuple[str, bool]]:
    """The last word on a gun of each run that had it, and of test shots: a stop may have been for the gun's fault."""
    yield from ((one.utc, True) for one in owed_shots(results) if one.gun in ("", gun))
    serials, found = _serials(gun), 0
    for path in nlargest(LOOKED_BACK, results.glob("sub-*/*_journal*.jsonl"), key=_written_ns):
        with suppress(JournalError):
            if path != own and any(map(journal_bytes(path).__contains__, serials)):
                yield last_word_on_gun(read_journal(path), gun)
                found += 1
        if found == _OF_GUN:
            return


def _serials(gun: str) -> list[bytes]:
    """How a journal may hold the serial number of a gun of this name, quickly found: it, or what is behind a colon."""
    parts = gun.split(":")
    found = [":".join(parts[first:]) for first in range(len(parts))]
    return [b'"serial":' + json.dumps(one, ensure_ascii=False).encode() for one in found]


def _written_ns(path: Path) -> int:
    with suppress(OSError):  # another console has just set it aside
        return path.stat().st_mtime_ns
    return 0
