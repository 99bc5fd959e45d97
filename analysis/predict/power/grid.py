"""What `recoil power` is asked for, spelled out as a grid of designs with their costs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from analysis.paper.paper import PublishedExperiment, load_paper
from analysis.predict.power.request import (
    FELT,
    PowerRequest,
    check_scalars,
    checked_setup,
    factors,
    method_sets_of,
    trials_of,
    whole_numbers,
)
from analysis.predict.power.studies import Chunk, DrawnConfig, PeopleKind, StudyDesign
from analysis.predict.synthetic_studies import (
    Felt,
    felt_people,
    null_felt,
    null_rates,
    null_ratings,
    percepts_of_setup,
    piece_sizes,
)
from experiments.direction.config import DirectionConfig
from experiments.load import find
from experiments.preference.config import PreferenceConfig
from experiments.synthetic.percept import Percept

__all__ = ["Grid", "GridCell", "PowerRequest", "make_grid"]

DEFAULT_PARTICIPANTS = "6,8,10,12,14,16,18,20,24,28,32,40"
NULL_PARTICIPANTS = "8,14,24"
DEFAULT_EFFECTS = "0.5,0.75,1"
_MOST_PEOPLE = 999


@dataclass(frozen=True, slots=True, kw_only=True)
class GridCell:
    """A design with the config that it makes, and its cost; `too_long` says why it may not be run, or nothing."""

    design: StudyDesign
    config: DrawnConfig
    duration_s: float
    too_long: str

    @property
    def lab_hours(self) -> float:
        """Hours of sessions, one participant after another."""
        return self.design.participants * self.duration_s / 3600.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Grid:
    """All cells in their order; `reference` is the paper's own design, with the published claims.

    `percepts`: what the gun's shots give to feel, by method, if the participants feel it.
    """

    config: DrawnConfig
    cells: tuple[GridCell, ...]
    reference: GridCell | None
    published: PublishedExperiment | None
    request: PowerRequest
    percepts: Mapping[str, Percept] | None = None

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
        if self.percepts is None or not isinstance(cell.config, DirectionConfig):
            return None
        return felt_people(cell.config, self.percepts, cell.design.methods, cell.design.effect)


def make_grid(request: PowerRequest) -> Grid:
    """The grid of a request. `ConfigError` with a message for people for whatever is wrong with it."""
    check_scalars(request)
    setup = checked_setup(request.config)
    config: DrawnConfig = setup.config
    people = request.participants or (NULL_PARTICIPANTS if request.null else DEFAULT_PARTICIPANTS)
    participants = whole_numbers(people, "--participants", 2, _MOST_PEOPLE)
    effects = [0.0] if request.null else factors(request.effects or DEFAULT_EFFECTS)
    designs = [
        (_varied(config, methods, trials), StudyDesign(participants=n, trials=trials, methods=methods, effect=effect))
        for methods in method_sets_of(request.methods, config)
        for trials in trials_of(request.trials, config)
        for effect in effects
        for n in participants
    ]
    if request.null:
        designs = [_null(*pair, who) for who in _null_people(config) for pair in designs]
    published = None if request.null else _published(request.paper, config)
    return Grid(
        config=config,
        cells=tuple(_cell(*pair) for pair in designs),
        reference=_reference(config, published),
        published=published,
        request=request,
        percepts=percepts_of_setup(setup) if config.synthetic.observer == FELT else None,
    )


def _varied(config: DrawnConfig, methods: tuple[str, ...], trials: int) -> DrawnConfig:
    """The config with these methods and trials; not checked again, so that what it breaks can be told."""
    changes: dict[str, Any] = {"methods": methods}
    if isinstance(config, DirectionConfig):
        design = config.design
        forward = trials * design.forward_per_session // design.trials_per_session
        changes |= {
            "sets_per_session": trials // design.trials_per_set,
            "forward_per_session": forward,
            "backward_per_session": trials - forward,
        }
    return config.model_copy(update={"design": config.design.model_copy(update=changes)})


def _null_people(config: DrawnConfig) -> tuple[PeopleKind, ...]:
    if isinstance(config, PreferenceConfig):
        return ("without preference",)
    return ("guessing", "guessing, with the config's bias")


def _null(config: DrawnConfig, design: StudyDesign, people: PeopleKind) -> tuple[DrawnConfig, StudyDesign]:
    """The design with null participants."""
    config = config.model_copy(update={"synthetic": _null_synthetic(config, people)})
    return config, replace(design, people=people)


def _null_synthetic(config: DrawnConfig, people: PeopleKind) -> Any:
    if isinstance(config, PreferenceConfig):
        return config.synthetic.model_copy(update={"ratings": null_ratings(config.synthetic.ratings)})
    if config.synthetic.observer == FELT:
        return null_felt(config.synthetic, biased="bias" in people)
    return config.synthetic.model_copy(update={"rates": null_rates(config.synthetic.rates, biased="bias" in people)})


def _cell(config: DrawnConfig, design: StudyDesign) -> GridCell:
    longest = config.fatigue.max_planned_s
    longer = config.duration_s > longest
    reason = f"{config.duration_s:g} s a participant exceed fatigue.max_planned_s = {longest:g} s" if longer else ""
    return GridCell(design=design, config=config, duration_s=config.duration_s, too_long=reason)


def _published(name: str, config: DrawnConfig) -> PublishedExperiment | None:
    """The published claims about these methods; `None` if the paper is about others."""
    paper = load_paper(find(name))
    published: PublishedExperiment = getattr(paper, config.experiment)
    one_way = isinstance(config, DirectionConfig) and not config.design.backward_per_session
    return None if one_way or set(published.methods) != set(config.design.methods) else published


def _is_of(published: PublishedExperiment | None, cell: GridCell) -> bool:
    return published is not None and set(published.methods) == set(cell.design.methods)


def _reference(config: DrawnConfig, published: PublishedExperiment | None) -> GridCell | None:
    """The paper's own number of people with the config's trials and effects."""
    if published is None:
        return None
    trials = next(iter(trials_of(None, config)))
    return _cell(config, StudyDesign(participants=published.n, trials=trials, methods=config.design.methods))
