"""What `recoil power` is asked for, spelled out as a grid of designs with their costs, and the studies of each."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import asdict, dataclass, field, replace
from typing import Literal

import numpy as np

from analysis.paper.paper import PublishedExperiment, load_paper
from analysis.paper.recurrence import with_whole_pattern
from analysis.predict.drawn import DirectionStudies, Drawn, RatingStudies, studies_of
from analysis.predict.power.planned import Findings, Tally, analysed_directions, analysed_ratings, tallied
from analysis.predict.synthetic_studies import (
    Counts,
    Felt,
    direction_counts,
    felt_counts,
    felt_people,
    felt_probit,
    null_felt,
    null_rates,
    null_ratings,
    percepts_of_methods,
    piece_sizes,
    preference_scores,
    published_claims,
    rates_of,
    scaled_means,
)
from analysis.stats.arrays import FloatArray
from device.words import DIRECTIONS
from experiments.config.door import ConfigError
from experiments.config.setup import Setup, canonical_json
from experiments.design.config import DesignConfig
from experiments.design.streams import generator
from experiments.load import find, load_setup
from experiments.synthetic.laws import DiffusionLaw, RatesLaw
from experiments.synthetic.percept import Percept

_LARGEST_EFFECT = 10.0


@dataclass(frozen=True, slots=True, kw_only=True)
class PowerRequest:
    """What the command line asks for. Lists are text, as in `8,10,14-20`."""

    config: str
    participants: str | None = None
    trials: str | None = None
    methods: tuple[str, ...] = ()
    effects: str | None = None
    studies: int = 10_000
    target: float = 0.8
    null: bool = False
    seed: int = 1
    paper: str = "paper"


def check_scalars(request: PowerRequest) -> None:
    """`ConfigError` for a target that is no share, and for an effect of people who feel none."""
    if not 0.0 < request.target < 1.0:
        raise ConfigError(f"--target {request.target:g}: must lie between 0 and 1, such as 0.8")
    if request.null and request.effects is not None:
        raise ConfigError(f"--null has no effect at all; leave --effect {request.effects} out")


def method_sets_of(asked: tuple[str, ...], config: Drawn) -> list[tuple[str, ...]]:
    """The sets of methods to compare: the config's own unless some are named."""
    known, sets = config.methods, []
    for text in asked or (",".join(known),):
        names = [name.strip() for name in text.split(",")]
        strangers = [name for name in names if name not in known]
        if strangers or len(set(names)) != len(names) or len(names) < 2:
            raise ConfigError(f"--methods {text}: must be two or more different ones of {', '.join(known)}")
        sets.append(tuple(method for method in known if method in names))
    return list(dict.fromkeys(sets))


def trials_per_method(asked: str | None, config: Drawn) -> list[int]:
    """The trials of one method: the config's own unless some are named."""
    if isinstance(config, RatingStudies):
        if asked is not None:
            raise ConfigError(f"--trials {asked}: {config.design.title!r} has one trial a method; leave the option out")
        return [1]
    forward, backward = config.trials
    if asked is None:
        return [forward + backward]
    whole = 2 if backward else 1
    step = math.lcm(config.trials_per_set * max(1, len(config.instructions)), whole)
    found = whole_numbers(asked, "--trials", 1, 10_000)
    uneven = [trials for trials in found if trials % step]
    if uneven and "-" not in asked:
        raise ConfigError(
            f"--trials {asked}: {uneven[0]} is no multiple of {step}, so it makes no sets of {config.trials_per_set} "
            f"with forward and backward trials as the config has them ({forward} to {backward})"
        )
    fitting = [trials for trials in found if trials % step == 0]
    if not fitting:
        raise ConfigError(f"--trials {asked}: holds no multiple of {step}")
    return fitting


def whole_numbers(text: str, option: str, low: int, high: int) -> list[int]:
    """Whole numbers and ranges, in order and once each. `ConfigError` for others, or outside `low`..`high`.

    >>> whole_numbers("14, 8-10", "--participants", 2, 999)
    [8, 9, 10, 14]
    """
    found = set[int]()
    for part in text.split(","):
        match = re.fullmatch(r"\s*([0-9]{1,9})\s*(?:-\s*([0-9]{1,9})\s*)?", part)
        if not match:
            raise ConfigError(f"{option} {text}: {part.strip()!r} is no whole number and no range such as 8-20")
        first, last = int(match[1]), int(match[2] or match[1])
        if not low <= first <= last <= high:
            raise ConfigError(f"{option} {text}: {part.strip()} must be from {low} to {high}, ranges upwards")
        found |= set(range(first, last + 1))
    return sorted(found)


def factors(text: str) -> list[float]:
    """Effect factors, in order and once each. `ConfigError` for what is not a number from 0 to 10.

    >>> factors("1,0.5")
    [0.5, 1.0]
    """
    found = set[float]()
    for part in text.split(","):
        try:
            value = float(part)
        except ValueError:
            value = math.nan
        if not 0.0 <= value <= _LARGEST_EFFECT:
            raise ConfigError(
                f"--effect {text}: {part.strip()!r} must be a number from 0 (none) to {_LARGEST_EFFECT:g}"
            )
        found.add(value)
    return sorted(found)


DEFAULT_PARTICIPANTS = "6,8,10,12,14,16,18,20,24,28,32,40"
NULL_PARTICIPANTS = "8,14,24"
DEFAULT_EFFECTS = "0.5,0.75,1"
_MOST_PEOPLE = 999


@dataclass(frozen=True, slots=True, kw_only=True)
class GridCell:
    """A design with the config that it makes, and its cost; `too_long` says why it may not be run, or nothing."""

    design: StudyDesign
    config: Drawn
    duration_s: float
    too_long: str

    @property
    def lab_hours(self) -> float:
        """Hours of sessions, one participant after another."""
        return self.design.participants * self.duration_s / 3600.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Grid:
    """All cells in their order; `reference` is the paper's own design, with the published claims.

    `percepts`: what the gun's shots give to feel, by method, if the participants feel it. `labels`: what the gun calls
    its methods.
    """

    config: Drawn
    cells: tuple[GridCell, ...]
    reference: GridCell | None
    published: PublishedExperiment | None
    request: PowerRequest
    percepts: Mapping[str, Percept] | None = None
    labels: Mapping[str, str] = field(default_factory=dict)

    @property
    def all_cells(self) -> tuple[GridCell, ...]:
        """The cells, and the reference after them if it is none of them."""
        apart = [self.reference] if self.reference and self.reference not in self.cells else []
        return (*self.cells, *apart)

    def chunks(self) -> list[Chunk]:
        """The work, in its order: so many studies of every cell, in pieces."""
        return [chunk for cell in self.all_cells for chunk in self.chunks_of(cell)]

    def chunks_of(self, cell: GridCell) -> list[Chunk]:
        """The pieces of a cell."""
        published = self.published if _is_of(self.published, cell) else None
        return [
            Chunk(
                config=cell.config,
                design=cell.design,
                published=published,
                seed=self.request.seed,
                number=number,
                studies=studies,
                felt=self._felt(cell),
            )
            for number, studies in enumerate(piece_sizes(self.request.studies, cell.design.participants))
        ]

    def _felt(self, cell: GridCell) -> Felt | None:
        config, design = cell.config, cell.design
        if self.percepts is None or isinstance(config, RatingStudies) or not isinstance(config.law, DiffusionLaw):
            return None
        return felt_people(config.law, config.instructions, self.percepts, design.methods, design.effect)


def make_grid(request: PowerRequest) -> Grid:
    """The grid of a request. `ConfigError` with a message for people for whatever is wrong with it."""
    check_scalars(request)
    setup = load_setup(request.config)
    config = studies_of(setup)
    people = request.participants or (NULL_PARTICIPANTS if request.null else DEFAULT_PARTICIPANTS)
    participants = whole_numbers(people, "--participants", 2, _MOST_PEOPLE)
    effects = [0.0] if request.null else factors(request.effects or DEFAULT_EFFECTS)
    designs = [
        (config.varied(methods, trials), StudyDesign(participants=n, trials=trials, methods=methods, effect=effect))
        for methods in method_sets_of(request.methods, config)
        for trials in trials_per_method(request.trials, config)
        for effect in effects
        for n in participants
    ]
    if request.null:
        designs = [_null(*pair, who) for who in _null_people(config) for pair in designs]
    published = None if request.null else _published(request.paper, config)
    return Grid(
        config=config,
        cells=tuple(_cells(designs)),
        reference=_reference(config, published),
        published=published,
        request=request,
        percepts=_percepts(setup, config),
        labels=setup.gun.labels,
    )


def _percepts(setup: Setup[DesignConfig], config: Drawn) -> dict[str, Percept] | None:
    law = config.law
    return percepts_of_methods(setup.gun, config.methods, law) if isinstance(law, DiffusionLaw) else None


def _null_people(config: Drawn) -> tuple[PeopleKind, ...]:
    if isinstance(config, RatingStudies):
        return ("without preference",)
    return ("guessing", "guessing, with the config's bias")


def _null(config: Drawn, design: StudyDesign, people: PeopleKind) -> tuple[Drawn, StudyDesign]:
    """The design with null participants."""
    return _null_config(config, biased="bias" in people), replace(design, people=people)


def _null_config(config: Drawn, *, biased: bool) -> Drawn:
    if isinstance(config, RatingStudies):
        return replace(config, law=null_ratings(config.law))
    if isinstance(config.law, DiffusionLaw):
        return replace(config, law=null_felt(config.law, biased=biased))
    return replace(config, law=null_rates(config.law, biased=biased))


def _cells(designs: Iterable[tuple[Drawn, StudyDesign]]) -> Iterator[GridCell]:
    """The cells; a design is planned once for all numbers of people and effects."""
    planned: dict[tuple[tuple[str, ...], int], float] = {}
    for config, design in designs:
        key = (design.methods, design.trials)
        if key not in planned:
            planned[key] = config.planned().duration_s
        yield _cell(config, design, planned[key])


def _cell(config: Drawn, design: StudyDesign, duration_s: float) -> GridCell:
    longest = config.design.fatigue.max_planned_s
    longer = duration_s > longest
    reason = f"{duration_s:g} s a participant exceed fatigue.max_planned_s = {longest:g} s" if longer else ""
    return GridCell(design=design, config=config, duration_s=duration_s, too_long=reason)


def _published(name: str, config: Drawn) -> PublishedExperiment | None:
    """The published claims about these methods; `None` if the paper is about others."""
    paper = load_paper(find(name))
    published: PublishedExperiment = paper.preference if isinstance(config, RatingStudies) else paper.direction
    one_way = isinstance(config, DirectionStudies) and not config.trials[1]
    return None if one_way or set(published.methods) != set(config.methods) else published


def _is_of(published: PublishedExperiment | None, cell: GridCell) -> bool:
    return published is not None and set(published.methods) == set(cell.design.methods)


def _reference(config: Drawn, published: PublishedExperiment | None) -> GridCell | None:
    """The paper's own number of people with the config's trials and effects."""
    if published is None:
        return None
    trials = next(iter(trials_per_method(None, config)))
    design = StudyDesign(participants=published.n, trials=trials, methods=config.methods)
    return _cell(config, design, config.planned().duration_s)


PeopleKind = Literal["own", "guessing", "guessing, with the config's bias", "without preference"]
"""Who takes part: the config's own synthetic participants, or null participants who feel no difference."""

PUBLISHED = "published"
"""What the names of the published claims begin with."""


@dataclass(frozen=True, slots=True, kw_only=True)
class StudyDesign:
    """A cell of the grid; `effect` is the factor on what people feel, `trials` those of one method."""

    participants: int
    trials: int
    methods: tuple[str, ...]
    effect: float = 1.0
    people: PeopleKind = "own"

    @property
    def key(self) -> str:
        """Its name, for the random streams."""
        return canonical_json(asdict(self)).decode()


@dataclass(frozen=True, slots=True, kw_only=True)
class Chunk:
    """So many studies of a design. `config` is that of the design: its methods and trials; `felt` who feel the gun."""

    config: Drawn
    design: StudyDesign
    published: PublishedExperiment | None
    seed: int
    number: int
    studies: int
    felt: Felt | None = None

    @property
    def people(self) -> int:
        """How many people it draws."""
        return self.studies * self.design.participants


def run_chunk(chunk: Chunk) -> Tally:
    """Draw and analyse a chunk's studies."""
    config, design = chunk.config, chunk.design
    draws = generator(chunk.seed, "power", config.design.design, design.key, str(chunk.number))
    if isinstance(config, RatingStudies):
        return tallied(_ratings(config, design, chunk, draws))
    return tallied(_directions(config, design, chunk, draws))


def _directions(config: DirectionStudies, design: StudyDesign, chunk: Chunk, draws: np.random.Generator) -> Findings:
    trials = config.trials
    if chunk.felt is None:
        correct = direction_counts(config, design.participants, chunk.studies, draws, design.effect)
        expected, expected_d = _expected(rates_of(config), design)
    else:
        correct = felt_counts(chunk.felt, trials, design.participants, chunk.studies, draws)
        expected = expected_d = np.asarray(chunk.felt.log_odds).tolist()  # rates rise with it, and d' has its sign
    found = analysed_directions(correct, trials, design.methods, expected, expected_d)
    return _with_published(found, correct, trials, chunk)


def _expected(rates: RatesLaw, design: StudyDesign) -> tuple[list[float], list[float]]:
    """What is expected of the correct rates on forward shots (their order), and of d' (its sign), by method."""
    felt = [[design.effect * felt_probit(rates, method, way) for way in DIRECTIONS] for method in design.methods]
    return [row[0] for row in felt], [row[0] - row[1] for row in felt]


def _ratings(config: RatingStudies, design: StudyDesign, chunk: Chunk, draws: np.random.Generator) -> Findings:
    scores = preference_scores(config, design.participants, chunk.studies, draws, design.effect)
    expected = scaled_means(config.law, design.methods, design.effect)
    found = analysed_ratings(scores, design.methods, expected.tolist())
    return _with_published(found, scores, (0, 0), chunk)


def _with_published(found: Findings, answers: Counts | FloatArray, trials: tuple[int, int], chunk: Chunk) -> Findings:
    """With the published claims, if there are any of these methods, and their whole pattern."""
    if chunk.published is None:
        return found
    claims = with_whole_pattern(published_claims(answers, trials, chunk.design.methods, chunk.published))
    named = {f"{PUBLISHED}, {claim}": held for claim, held in claims.items()}
    return replace(found, claims=dict(found.claims) | named)
