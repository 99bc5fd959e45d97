"""The trials of adaptive tracks, before their levels are known: a track for each cell and start, as long as it can be.

What varies within a track, and the place of the comparison among the intervals, is shuffled over all its trials.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

from experiments.config.door import ConfigError
from experiments.design.config import DesignConfig
from experiments.design.contents import Content, Streams, arrangements, catch_contents, cells, in_order, some_places
from experiments.design.language import MAX_TRIALS
from experiments.design.plan import CHOSEN, Condition
from experiments.design.procedures.config import AdaptiveConfig, starts_of
from experiments.design.streams import Stream


def own_tracks_words(design: DesignConfig) -> str:
    """Why tracks are many: what a message of too many trials goes on with; nothing where there is one cell."""
    table = design.adaptive
    several = [name for name in _with_own(design, table) if len(design.factors[name].all_levels) > 1] if table else []
    if not several:
        return ""
    return (
        f"; each level of {' and '.join(several)} has tracks of its own: name it in procedure.of or procedure.mixed, "
        "or give it fewer levels"
    )


def track_parts(
    design: DesignConfig, table: AdaptiveConfig, given: Condition, set_levels: Sequence[Condition], streams: Streams
) -> list[list[Content]]:
    """What each set of a session holds, in order; tracks are counted from 1 in the session.

    `ConfigError`: trials that cannot be shared equally among the sets.
    """
    fixed = _with_own(design, table)
    parts: dict[int, list[Content]] = {}
    tracks = 0
    for combo in dict.fromkeys(set_levels):
        places = [at for at, levels in enumerate(set_levels) if levels == combo]
        found = cells(design, fixed, (*given, *combo))
        made = [
            _track(design, table, cell, tracks + number, streams)
            for number, (cell, _) in enumerate(product(found, starts_of(table)), start=1)
        ]
        tracks += len(made)
        if tracks * table.trials > MAX_TRIALS:
            raise ConfigError(
                f"procedure.trials = {table.trials}: tracks make more than {MAX_TRIALS:,} trials together"
                f"{own_tracks_words(design)}"
            )
        ordered = _ordered(table, made, streams.of("tracks", *(str(level) for _, level in combo)))
        parts |= dict(zip(places, _shared(ordered, len(places)), strict=True))
    return _with_catch(design, [parts[at] for at in sorted(parts)], given, streams)


def _with_own(design: DesignConfig, table: AdaptiveConfig) -> list[str]:
    """The factors that vary and whose levels have tracks of their own: neither chosen nor mixed."""
    return [name for name in design.varying if name not in (*table.of, *table.mixed)]


def _track(
    design: DesignConfig, table: AdaptiveConfig, cell: Condition, number: int, streams: Streams
) -> list[Content]:
    """The trials of a track, with every form that they can have as equally often as it goes."""
    trial, stream = design.trial, streams.of("track", str(number))
    held: list[tuple[tuple[str | float, ...], int | None]] = [((), None)]
    if trial.kind == "pair":
        held = [((CHOSEN, CHOSEN), None)]
    elif trial.standard is not None:
        held = [*arrangements(trial, CHOSEN, trial.standard)]
    forms = [
        Content(in_order(design, (*cell, *mixed)), intervals, odd, track=number)
        for mixed in cells(design, table.mixed)
        for intervals, odd in held
    ]
    return stream.shuffled([forms[place % len(forms)] for place in some_places(table.trials, stream, len(forms))])


def _ordered(table: AdaptiveConfig, tracks: Sequence[Sequence[Content]], stream: Stream) -> list[Content]:
    """All trials of some tracks: in rounds of one trial each in random order, or one track after another."""
    if not table.interleave:
        return [content for track in stream.shuffled(tracks) for content in track]
    return [content for turn in zip(*tracks, strict=True) for content in stream.shuffled(turn)]


def _shared(contents: Sequence[Content], sets: int) -> list[list[Content]]:
    if len(contents) % sets:
        near = [n for n in range(1, len(contents) + 1) if len(contents) % n == 0]
        shown = sorted(near, key=lambda n: abs(n - sets))[:2]
        raise ConfigError(
            f"order.sets: {len(contents)} trials cannot be shared equally among {sets} sets; nearest: "
            f"{' or '.join(map(str, sorted(shown)))}"
        )
    size = len(contents) // sets
    return [list(contents[at * size : (at + 1) * size]) for at in range(sets)]


def _with_catch(
    design: DesignConfig, parts: list[list[Content]], given: Condition, streams: Streams
) -> list[list[Content]]:
    """The sets with as many catch trials each, at random places."""
    names = [name for name in design.varying if name not in design.adapted]
    catch = catch_contents(design, cells(design, names, given))
    shared = _shared(catch, len(parts)) if catch else [[] for _ in parts]
    pairs = enumerate(zip(parts, shared, strict=True))
    return [_mixed_in(part, blanks, streams.of("catch", str(at))) for at, (part, blanks) in pairs]


def _mixed_in(part: Sequence[Content], blanks: Sequence[Content], stream: Stream) -> list[Content]:
    """Some trials at random places among others, which keep their order."""
    kept, left = iter(part), iter(blanks)
    return [next(left if blank else kept) for blank in stream.shuffled([False] * len(part) + [True] * len(blanks))]
