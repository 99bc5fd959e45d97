"""What the page shows of a folder, as HTML: the runs that are open, one card each, and those that are finished."""

from __future__ import annotations

import math
from datetime import datetime
from html import escape
from importlib.resources import files
from string import Template

from device.messages import how_many
from experiments.clock import date_text
from experiments.session.duration import end_text
from experiments.watch.folder import Watched
from experiments.watch.runs import RunRow, SyncTimes, WatchedState, age_s

PAGE_PARTS = ("summary", "open", "finished")
"""The parts of the page that change, by their ids."""
PROBLEMS_SHOWN = 20
"""So many things that cannot be read are named on the page."""

_SIGNS: dict[WatchedState, str] = {
    "running": "▶",
    "paused": "‖",
    "emergency stop": "■",
    "damaged": "!",
    "gone": "?",
    "broken off": "×",
    "stopped": "□",
    "beginning": "…",
    "not begun": "…",
    "finished": "✓",
}
"""A sign beside each word, so that no colour has to be told from another. In order of urgency."""

_MEANING: dict[WatchedState, str] = {
    "gone": "Its journal is gone: it was deleted, moved or set aside while it was watched. What stands here was read "
    "before.",
    "broken off": "No end is on record, and no process of this machine holds the journal: the run was killed, goes on "
    "at another machine, or this is a copy. If it was killed, resume it.",
    "stopped": "It was stopped and can be resumed.",
    "not begun": "Nothing was acknowledged.",
    "beginning": "Its first record is being written.",
}
_MOOD: dict[WatchedState, str] = {"running": "good", "finished": "good", "paused": "wait", "beginning": "wait"}


def whole_page(parts: tuple[str, ...], folder: str) -> bytes:
    """The page with its parts, as it is before anything changes."""
    template = Template(static("page.html").decode())
    return template.substitute(dict(zip(PAGE_PARTS, parts, strict=True)), folder=escape(folder)).encode(
        errors="replace"
    )


def static(name: str) -> bytes:
    """A file that the page needs."""
    return files("experiments.watch").joinpath("static", name).read_bytes()


def page_parts(seen: Watched) -> tuple[str, ...]:
    """The parts of the page that change, each on one line."""
    order = list(_SIGNS)
    still_open = [row for row in seen.rows if row.state != "finished"]
    still_open.sort(key=lambda row: order.index(row.state))  # stable: codes stay in order
    finished = [row for row in seen.rows if row.state == "finished"]
    cards = "".join(_card(row, seen.utc) for row in still_open) or "<p class=note>No run is open.</p>"
    lines = f"<ul>{''.join(map(_line, finished))}</ul>" if finished else "<p class=note>None yet.</p>"
    return tuple(" ".join(part.split("\n")) for part in (_summary(seen), cards, lines))


def _summary(seen: Watched) -> str:
    counts = [(word, sum(row.state == word for row in seen.rows)) for word in _SIGNS]
    none = "no run is to be seen" if seen.problems else "no run has begun here"
    said = [f"{count} {word}" for word, count in counts if count] or [none]
    said += [f"{seen.unread} still to be read"] * bool(seen.unread)
    said += [f"{seen.set_aside} set aside, not shown"] * bool(seen.set_aside)
    told, more = seen.problems[:PROBLEMS_SHOWN], len(seen.problems) - PROBLEMS_SHOWN
    told += (f"and {more} more of this kind",) * (more > 0)
    problems = "".join(f'<p class="problem">{escape(problem)}</p>' for problem in told)
    return f"<p>{escape(' · '.join(said))}</p>{problems}"


def _card(row: RunRow, now: datetime) -> str:
    mood = _MOOD.get(row.state, "bad")
    parts = [
        f"<h3>{escape(row.name)} <small>{escape(_what(row))}</small></h3>",
        f'<p class="state {mood}"><span aria-hidden="true">{_SIGNS[row.state]}</span> {row.state}'
        f"{f': {escape(row.doing)}' if row.doing else ''}</p>",
        _progress(row),
        f'<p class="note">{_MEANING[row.state]}</p>' if row.state in _MEANING else "",
        f'<p class="problem">{escape(row.problem)}</p>' if row.problem else "",
        _facts(row, now),
    ]
    return f'<article class="{mood}">{"".join(parts)}</article>'


def _what(row: RunRow) -> str:
    """Which run it is, and whose data it gives where they are no real ones."""
    kind = "" if row.data in (None, "real") else str(row.data).upper()
    return " · ".join(filter(None, (row.experiment, "practice" if row.practice else "", kind)))


def _progress(row: RunRow) -> str:
    if not row.planned:
        return ""
    return (
        f"<p class=where>{escape(row.where)}</p>"
        f'<progress max="{row.planned}" value="{row.done}" aria-label="trials done"></progress>'
        f"<p class=count>{row.done} of {how_many(row.planned, 'trial')} done</p>"
    )


def _facts(row: RunRow, now: datetime) -> str:
    facts: list[tuple[str, str]] = []
    if row.left_s is not None:
        ends = "" if row.state == "paused" else f", ends {end_text(row.left_s, now.astimezone())}"
        facts.append(("Still to go", f"about {minutes_text(row.left_s)}{ends}"))
    if row.last_utc:
        facts.append(("Last record", _last_text(row, now)))
    if row.sync is not None:
        facts.append(("On the disk after", _sync_text(row.sync)))
    if row.planned:
        facts.append(("Faults", _faults_text(row)))
    return "<dl>" + "".join(f"<dt>{name}</dt><dd>{escape(said)}</dd>" for name, said in facts) + "</dl>"


def _last_text(row: RunRow, now: datetime) -> str:
    if row.virtual:
        return "on a virtual clock"
    if row.state in ("stopped", "broken off", "gone"):
        return date_text(row.last_utc)
    return f"{ago_text(age_s(row.last_utc, now))} ago"


def _sync_text(sync: SyncTimes) -> str:
    return f"{_ms_text(sync.last_s)}, at the longest {_ms_text(sync.longest_s)}"


def _ms_text(seconds: float) -> str:
    return f"{1000 * seconds:.1f} ms" if seconds < 1 else f"{seconds:.1f} s"


def _faults_text(row: RunRow) -> str:
    if row.last_fault is None:
        return "none"
    when = "" if row.virtual else f"{date_text(row.last_fault.utc)}: "
    return f"{row.faults}; the last {when}{row.last_fault.what}"


def _line(row: RunRow) -> str:
    """A finished run."""
    when = "" if row.virtual else f", {date_text(row.last_utc)}"
    faults = f", {how_many(row.faults, 'fault')}" if row.faults else ""
    said = f"{_what(row)}: {row.done} of {how_many(row.planned, 'trial')}{faults}{when}"
    return f"<li><b>{escape(row.name)}</b> {escape(said)}</li>"


def ago_text(seconds: float) -> str:
    """How long ago something was, as coarse as people say it.

    >>> ago_text(0.4), ago_text(75), ago_text(7300), ago_text(200_000)
    ('0 s', '75 s', '2 h', '2 days')
    """
    for unit_s, word, most in ((1, "s", 100), (60, "min", 100), (3600, "h", 48)):
        if seconds < most * unit_s:
            return f"{max(0, math.floor(seconds / unit_s))} {word}"
    return f"{math.floor(seconds / 86400)} days"


def minutes_text(seconds: float) -> str:
    """How long something takes, in whole minutes.

    >>> minutes_text(20), minutes_text(125), minutes_text(4000)
    ('1 min', '2 min', '1 h 7 min')
    """
    hours, minutes = divmod(max(1, round(seconds / 60)), 60)
    return f"{hours} h {minutes} min" if hours else f"{minutes} min"
