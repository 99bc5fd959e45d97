"""From a design to the plan of one participant: cells, sessions, sets, intervals, and the order of everything. Pure.

Every shuffle has a stream of its own, so a change of one factor changes no other factor's order. What cannot be
balanced as the design asks is refused with the nearest numbers that can.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

from experiments.config.door import ConfigError, Order
from experiments.design.config import DesignConfig
from experiments.design.contents import Content, Streams, cells, in_order, session_cells, trial_contents
from experiments.design.language import INSTRUCTION_FACTOR, BlockOrder, Level, shown_level
from experiments.design.plan import Condition, Plan, Trial, square_rows
from experiments.design.procedures.config import least_of_track
from experiments.design.streams import Stream
from experiments.design.track_planning import track_parts


def groups(design: DesignConfig) -> list[Condition]:
    """The combinations of levels that vary between people; one empty group if none does."""
    return cells(design, design.between)


def square_size(design: DesignConfig) -> int:
    """How many rows the balancing square has; 0 if no order is balanced over participants."""
    return max(
        len(square_rows(_square(design.order.sessions), len(_sessions(design, ())))),
        len(square_rows(_square(design.order.trials), len(session_cells(design, ())))),
    )


def _square(order: BlockOrder) -> Order:
    return "random" if order == "fixed" else order


def _sessions(design: DesignConfig, given: Condition) -> list[Condition]:
    return cells(design, design.order.session, given)


def plan_of(design: DesignConfig, participant_id: str, seed: int, *, row: int | None = None, group: int = 0) -> Plan:
    """The plan that a design, a participant, a seed, a row of the square and a group make; the same for the same.

    `ConfigError`: the row or group does not exist, or the design asks for a balance that there is none of.
    """
    given = _of_group(design, group)
    if row is not None and row not in range(square_size(design)):
        rows = square_size(design)
        rule = (
            f"the orders have {rows} rows, counted from 0"
            if rows
            else "no order of this design is balanced by a square"
        )
        raise ConfigError(f"order_row = {row!r}: {rule}")
    who = (design.design, participant_id)
    sessions = _ordered(design.order.sessions, _sessions(design, given), row, Stream(seed, "session-order", *who))
    trials = [
        trial
        for number, levels in enumerate(sessions, start=1)
        for trial in _session(design, number, (*given, *levels), Streams(seed, (*who, str(number))), row)
    ]
    return Plan(
        experiment=design.design,
        participant_id=participant_id,
        seed=seed,
        order_row=row,
        group=group,
        trials=tuple(_with_own_tracks(trials)),
        may_end_early=design.adaptive is not None and least_of_track(design.adaptive) < design.adaptive.trials,
    )


def _with_own_tracks(trials: Sequence[Trial]) -> Iterator[Trial]:
    """The trials with their tracks counted through all sessions, in the order in which they are met."""
    numbers: dict[tuple[int, int], int] = {}
    for trial in trials:
        own = numbers.setdefault((trial.session, trial.track), len(numbers) + 1) if trial.track else 0
        yield replace(trial, track=own) if own != trial.track else trial


def practice_of(design: DesignConfig, participant_id: str, seed: int, *, group: int = 0) -> Plan:
    """The plan of a practice: some trials of each cell of `practice.of`, mixed; a design may have none.

    The levels of the other factors are drawn. A practice is of the gun: it has no instruction. Each round that there
    may be is a set.
    """
    practice, given = design.practice, _of_group(design, group)
    streams = Streams(seed, (design.design, participant_id, "practice"))
    alike: dict[Condition, list[Content]] = {}
    for content in _everything(design, given, streams):
        cell = tuple(pair for pair in content.levels if pair[0] in practice.of)
        alike.setdefault(cell, []).append(content)
    drawn = [
        (number, content)
        for number in range(1, practice.rounds + 1)
        for content in _round(list(alike.values()), practice.repetitions, streams, number)
    ]
    trials = [
        _trial(design, (1, number, place), _without_instruction(content.levels), content)
        for place, (number, content) in enumerate(drawn, start=1)
    ]
    return Plan(
        experiment=design.design,
        participant_id=participant_id,
        seed=seed,
        order_row=None,
        group=group,
        trials=tuple(trials),
        practice=True,
        may_end_early=practice.until_right is not None,
    )


def _round(cells: Sequence[Sequence[Content]], count: int, streams: Streams, number: int) -> list[Content]:
    """So many trials of each cell, mixed: of each round by streams of its own, of the first as if there were one."""
    own = () if number == 1 else (str(number),)
    drawn = [
        content
        for at, alike in enumerate(cells)
        for content in _some(alike, count, streams.of("practice-cell", str(at), *own))
    ]
    return streams.of("practice", *own).shuffled(drawn)


def _without_instruction(levels: Condition) -> Condition:
    return tuple(pair for pair in levels if pair[0] != INSTRUCTION_FACTOR)


def _some(contents: Sequence[Content], count: int, stream: Stream) -> list[Content]:
    """So many of the contents, each as often as the others."""
    times = -(-count // len(contents))
    return stream.shuffled(list(contents) * times)[:count]


def _everything(design: DesignConfig, given: Condition, streams: Streams) -> Iterator[Content]:
    """Every trial that a participant may meet but catch trials, with all its levels."""
    for blocked in cells(design, (*design.order.session, *design.order.set), given):
        held = (*given, *blocked)
        for content in trial_contents(design, held, streams):
            if not content.catch:
                yield replace(content, levels=in_order(design, (*held, *content.levels)))


def _trial(design: DesignConfig, place: tuple[int, int, int], levels: Condition, content: Content) -> Trial:
    session, part, trial = place
    return Trial(
        session=session,
        set=part,
        trial=trial,
        levels=levels,
        compare=(design.trial.compare or "") if content.intervals else "",
        intervals=content.intervals,
        odd=content.odd,
        catch=content.catch,
        track=content.track,
    )


def _of_group(design: DesignConfig, group: int) -> Condition:
    """The levels of a group. `ConfigError`: there is none of that number."""
    among = groups(design)
    if group not in range(len(among)):
        raise ConfigError(f"group = {group!r}: there are {len(among)}, counted from 0")
    return among[group]


def _ordered(order: BlockOrder, items: Sequence[Condition], row: int | None, stream: Stream) -> list[Condition]:
    """The items at random, as they stand, or by a row of the square over them."""
    if order == "fixed":
        return list(items)
    rows = square_rows(order, len(items))
    if row is None or not rows:
        return stream.shuffled(items)
    return [items[place] for place in rows[row % len(rows)]]


def _session(design: DesignConfig, number: int, given: Condition, streams: Streams, row: int | None) -> Iterator[Trial]:
    set_levels = _set_levels(design, given, streams)
    table = design.adaptive
    parts = track_parts(design, table, given, set_levels, streams) if table else _parts(design, given, streams, row)
    place = 0
    for at, part in enumerate(parts):
        for content in part:
            place += 1
            levels = in_order(design, (*given, *set_levels[at], *content.levels))
            yield _trial(design, (number, at + 1, place), levels, content)


def _parts(design: DesignConfig, given: Condition, streams: Streams, row: int | None) -> list[list[Content]]:
    """What each set of a session holds, in order, where all levels are planned."""
    contents, sets = trial_contents(design, given, streams), design.order.sets
    check_sets(design, len(contents), len(cells(design, design.order.set, given)))
    if design.order.trials != "random":
        return _by_square(design, contents, row, sets)
    if design.order.longest_run:
        return _limited(design, contents, streams)
    shared = _shared(design, contents, streams)
    return [streams.of("trials", str(place)).shuffled(part) for place, part in enumerate(shared)]


def _set_levels(design: DesignConfig, given: Condition, streams: Streams) -> list[Condition]:
    """The levels of each set: each combination equally often, in random order."""
    found, sets = cells(design, design.order.set, given), design.order.sets
    if sets % len(found):
        nearest = (
            f"nearest: {_multiples(sets, len(found))}"
            if design.adaptive
            else _nearest_sets(sets, len(trial_contents(design, given, streams)), len(found))
        )
        raise ConfigError(
            f"order.sets = {sets} cannot be shared equally among the {len(found)} combinations of order.set; {nearest}"
        )
    return streams.of("set-order").shuffled(found * (sets // len(found)))


def _multiples(value: int, of: int) -> str:
    below, above = value // of * of, (value // of + 1) * of
    return " or ".join(str(one) for one in (below, above) if one)


def _nearest_sets(sets: int, trials: int, combinations: int) -> str:
    """Which numbers of sets share out both the trials and the combinations of levels that a set can have."""
    near = [n for n in range(combinations, trials + 1, combinations) if trials % n == 0]
    below = max((n for n in near if n < sets), default=None)
    above = min((n for n in near if n > sets), default=None)
    if not near:
        return f"no number can, as {trials} trials are no multiple of {combinations}: change order.repetitions"
    return f"nearest: {' or '.join(str(n) for n in (below, above) if n)}"


def check_sets(design: DesignConfig, trials: int, combinations: int = 1) -> None:
    """`ConfigError` unless the trials of a session share out equally among its sets, as `balance` asks.

    `combinations`: of the levels of `order.set`, each of which has as many sets; they bound what is advised.
    """
    order = design.order
    ranked = [name for name, question in design.questions.items() if question.kind == "ranking"]
    if ranked and trials == order.sets:
        raise ConfigError(f"questions.{ranked[0]}: sets of one trial leave nothing to rank; make order.sets smaller")
    if trials % order.sets:
        raise ConfigError(
            f"order.sets = {order.sets}: the {trials} trials of a session cannot be shared equally among them; "
            f"{_nearest_sets(order.sets, trials, combinations)}"
        )
    if order.balance == "set-exact" and order.repetitions % order.sets:
        raise ConfigError(
            f'order.balance = "set-exact" is impossible: {order.repetitions} repetitions cannot be shared equally '
            f"among {order.sets} sets; nearest: repetitions = {_multiples(order.repetitions, order.sets)}, or "
            'balance = "set" for as even as it gets'
        )


def _shared(design: DesignConfig, contents: list[Content], streams: Streams) -> list[list[Content]]:
    """The trials of each set, before they are shuffled."""
    sets, size = design.order.sets, len(contents) // design.order.sets
    if design.order.balance == "session" or sets == 1:
        mixed = streams.of("session-trials").shuffled(contents)
        return [mixed[place * size : (place + 1) * size] for place in range(sets)]
    alike: dict[tuple[Condition, bool], list[Content]] = {}
    for content in contents:
        alike.setdefault((_balanced(content, design), content.catch), []).append(content)
    # what divides goes to every set; what is left over is dealt round in a random order, so sizes stay equal
    dealt: list[list[Content]] = [[] for _ in range(sets)]
    left: list[Content] = []
    for cell in streams.of("dealing").shuffled(list(alike)):
        same = alike[cell]
        each = len(same) // sets
        for place in range(sets):
            dealt[place].extend(same[place * each : (place + 1) * each])
        left.extend(same[each * sets :])
    places = streams.of("dealing-sets").shuffled(range(sets))
    for at, content in enumerate(left):
        dealt[places[at % sets]].append(content)
    return dealt


def _balanced(content: Content, design: DesignConfig) -> Condition:
    """What is balanced of a trial: its cell, or its pair."""
    pair = tuple(sorted(map(shown_level, content.intervals))) if design.trial.kind == "pair" else ()
    return (*content.levels, *(("pair", one) for one in pair))


def _by_square(design: DesignConfig, contents: list[Content], row: int | None, sets: int) -> list[list[Content]]:
    """The cells in a row of the square, or as they stand, as often as they are repeated."""
    alike: dict[Condition, list[Content]] = {}
    for content in contents:
        alike.setdefault(_balanced(content, design), []).append(content)
    order = list(alike)
    rows = square_rows(_square(design.order.trials), len(order))
    if rows:
        order = [order[place] for place in rows[(row or 0) % len(rows)]]
    flat = [alike[cell][turn] for turn in range(design.order.repetitions) for cell in order if turn < len(alike[cell])]
    size = len(flat) // sets
    return [flat[place * size : (place + 1) * size] for place in range(sets)]


_TRIES = 200


def _limited(design: DesignConfig, contents: list[Content], streams: Streams) -> list[list[Content]]:
    """The sets in an order that keeps every limit on runs. `ConfigError`: none was found.

    What is in which set is drawn anew at each try, as far as `balance` leaves it open.
    """
    limits = design.order.longest_run
    for attempt in range(_TRIES):
        drawn = Streams(streams.seed, (*streams.session, "runs", str(attempt)))
        stream, run, done = streams.of("runs", str(attempt)), _Run(limits), []
        for part in _shared(design, contents, drawn):
            ordered = _in_limits(part, run, stream)
            if ordered is None:
                break
            done.append(ordered)
        else:
            return done
    shown = ", ".join(f"{name} = {most}" for name, most in limits.items())
    raise ConfigError(f"order.longest_run ({shown}): no such order was found in {_TRIES} tries; allow longer runs")


class _Run:
    """How long each limited factor's last level has been following itself."""

    def __init__(self, limits: Mapping[str, int]) -> None:
        self.limits = limits
        self.last: dict[str, tuple[Level | None, int]] = dict.fromkeys(limits, (None, 0))

    def length(self, name: str, level: Level | None) -> int:
        """The length of the run that one more of a level makes."""
        last, length = self.last[name]
        return length + 1 if last == level else 1

    def takes(self, content: Content) -> bool:
        levels = dict(content.levels)
        return all(self.length(name, levels.get(name)) <= most for name, most in self.limits.items())

    def add(self, content: Content) -> None:
        levels = dict(content.levels)
        self.last = {name: (levels.get(name), self.length(name, levels.get(name))) for name in self.limits}

    def fits(self, left: Mapping[str, Counter[Level | None]], total: int) -> bool:
        """Can what is left of every level still be placed? Necessary; with one limited factor sufficient."""
        for name, most in self.limits.items():
            last, length = self.last[name]
            for level, count in left[name].items():
                room = most - length if level == last else most
                if count > room + most * (total - count):
                    return False
        return True


def _in_limits(part: list[Content], run: _Run, stream: Stream) -> list[Content] | None:
    """One set in an order that keeps the limits, found from front to back; `None` if it ran into a dead end."""
    left = Counter(part)
    levels = {name: Counter(dict(content.levels).get(name) for content in part) for name in run.limits}
    done: list[Content] = []
    while len(done) < len(part):
        total = len(part) - len(done) - 1
        allowed = [
            one for one, count in left.items() if count and run.takes(one) and _leaves_room(one, run, levels, total)
        ]
        if not allowed:
            return None
        chosen = _drawn(allowed, left, stream)
        run.add(chosen)
        left[chosen] -= 1
        for name in run.limits:
            levels[name][dict(chosen.levels).get(name)] -= 1
        done.append(chosen)
    return done


def _drawn(allowed: Sequence[Content], left: Counter[Content], stream: Stream) -> Content:
    """One of the allowed, the more likely the more there is left of it."""
    place = stream.below(sum(left[one] for one in allowed))
    for one in allowed:
        place -= left[one]
        if place < 0:
            return one
    raise AssertionError("the counts are above 0")


def _leaves_room(content: Content, run: _Run, levels: Mapping[str, Counter[Level | None]], total: int) -> bool:
    after = _Run(run.limits)
    after.last = run.last
    after.add(content)
    own = dict(content.levels)
    left = {name: counts - Counter({own.get(name): 1}) for name, counts in levels.items()}
    return after.fits(left, total)
