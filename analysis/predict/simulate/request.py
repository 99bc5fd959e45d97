"""What `recoil simulate` is asked for."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from experiments.config.door import ConfigError

FIGURE_ENDINGS = (".png", ".svg", ".pdf")
_ENDING = re.compile(r"\.(?!v[0-9]+$)[a-z][a-z0-9]*")
"""How the kind of a file is named: .gif, .mp4; a number or a version, as .12, .5ms or .v2, belongs to a name."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ModelRequest:
    """Which model is wanted: by its name, by a scene's, or by needs, OUTPUT=ERROR each."""

    fidelity: str | None
    scene: str | None
    needs: Sequence[str]

    @property
    def is_of_scene(self) -> bool:
        """Is the model to be picked for a use of it?"""
        return self.scene is not None or bool(self.needs)


@dataclass(frozen=True, slots=True, kw_only=True)
class SimulateRequest:
    """What to simulate of which gun. `changes` are KEY=VALUE, `vary` KEY=VALUES; `table` takes the shots over these."""

    gun: str
    method: str | None
    changes: Sequence[str]
    model: ModelRequest
    trace: Path | None
    plot: Path | None
    audit: bool
    hand: str | None
    contact_stiffness_N_m: float | None
    vary: Sequence[str]
    table: Path | None
    yes: bool

    @property
    def plot_stem(self) -> Path | None:
        """Where the figure goes, without its ending; a number or a version behind a dot is of the name.

        `ConfigError`: a folder is there, there is no name, or an ending of something else.
        """
        if self.plot is None:
            return None
        if self.plot.is_dir():
            raise ConfigError(f"--plot {self.plot}: is a folder; name a file")
        ending = self.plot.suffix.lower()
        if _ENDING.fullmatch(ending) and ending not in FIGURE_ENDINGS:
            raise ConfigError(f"--plot {self.plot}: figures are PNG, SVG and PDF; name one of these, as in shot.png")
        if self.plot.name.lower() in ("", "..", *FIGURE_ENDINGS):
            raise ConfigError(f"--plot {self.plot}: has no name but its ending; name a file, as in shot.png")
        return self.plot.with_suffix("") if ending in FIGURE_ENDINGS else self.plot

    @property
    def figures(self) -> list[Path]:
        """The files of the figure. `ConfigError` as `plot_stem`."""
        stem = self.plot_stem
        return [] if stem is None else [stem.with_name(f"{stem.name}{ending}") for ending in FIGURE_ENDINGS]

    @property
    def of_one_shot(self) -> list[str]:
        """The options given that tell more of a single shot of a coil."""
        options = {
            "--audit": self.audit or None,
            "--hand": self.hand,
            "--contact-stiffness": self.contact_stiffness_N_m,
        }
        return [name for name, value in options.items() if value is not None]

    @property
    def of_files(self) -> list[str]:
        """The options given that ask for files of a single shot."""
        return [name for name, value in (("--trace", self.trace), ("--plot", self.plot)) if value is not None]

    @property
    def of_models(self) -> list[str]:
        """The options given that a vibration, which has no model, does not know."""
        options = {
            "--fidelity": self.model.fidelity,
            "--scene": self.model.scene,
            "--need": self.model.needs,
            "--set": self.changes,
            "--vary": self.vary,
            "--table": self.table,
        }
        return [name for name, value in options.items() if value]
