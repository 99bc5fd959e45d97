"""What a run is asked for."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from experiments.catalogues.catalogue import ENGLISH, Language
from experiments.config.setup import Setup
from experiments.design.config import DesignConfig
from experiments.design.streams import checked_seed, draw_seed
from experiments.record.journal import ParticipantKind

Again = Literal["ask", "resume", "fresh"]
"""What to do with an unfinished run: refuse and say what is there, go on with it, or set it aside."""
ScreenName = Literal["terminal", "synthetic", "console"]
"""Where a run is shown and worked."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ParticipantOptions:
    """What the participant has beside the console; `monitor` is the index of their screen, `None` for the last one."""

    screen: bool = False
    keys: bool = False
    noise: bool = False
    monitor: int | None = None

    @property
    def named(self) -> tuple[tuple[str, bool], ...]:
        """What a journal says that the participant was to have, by its name there."""
        return ("participant_screen", self.screen), ("participant_keys", self.keys), ("noise", self.noise)

    @property
    def any(self) -> bool:
        """Whether the participant's own process runs at all."""
        return self.screen or self.keys or self.noise


@dataclass(frozen=True, slots=True, kw_only=True)
class RunRequest:
    """Who does what, where, at which screen, with which gun and seed.

    `sensor` is empty where nothing measures what is delivered; with `markers` what happens goes to Lab Streaming Layer
    meanwhile. `seed` is `None` where the config or the system gives
    it. A `practice` is not analysed: it has files of its own and can be done again; nothing of a `training` is kept.
    `anew_reason` is why an unfinished run is set aside for a fresh one: for the register and the head of the new
    journal. At the console the participant may have `options` of their own, and a `visual` run is worked by a
    synthetic one. `language` is the participant's; `catalogues` is where else there are languages. Of a synthetic
    participant's run, which can be made again, records may be `synced_at_end`.
    """

    setup: Setup[DesignConfig]
    participant_id: str
    results: Path
    gun: str = "simulated"
    sensor: str = ""
    markers: bool = False
    seed: int | None = None
    again: Again = "ask"
    anew_reason: str = ""
    practice: bool = False
    training: bool = False
    screen: ScreenName = "synthetic"
    visual: bool = False
    options: ParticipantOptions = ParticipantOptions()
    language: Language = ENGLISH
    catalogues: Path | None = None
    synced_at_end: bool = False

    @property
    def simulated(self) -> bool:
        """Whether a synthetic participant answers."""
        return self.screen == "synthetic" or self.visual

    @property
    def participant_kind(self) -> ParticipantKind:
        """Who does the run, as the journal's head says it."""
        return "synthetic" if self.simulated else "person"

    @property
    def each_synced(self) -> bool:
        """Whether each record is on the disk before the next step: always where a person takes part."""
        return not (self.synced_at_end and self.simulated)


def resolve_seed(request: RunRequest) -> int:
    """The seed of a new run: asked for, else the config's, else drawn from the system."""
    for seed in (request.seed, request.setup.config.seed):
        if seed is not None:
            return checked_seed(seed)
    return draw_seed()
