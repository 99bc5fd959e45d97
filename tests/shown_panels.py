"""Panels of Figure 5, and figures saved in fewer kinds."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from analysis.report.figures.shot import ShotPanel


def shot_panel(collision_N: float = 53.7, landing_s: float = 0.15) -> ShotPanel:
    time = np.linspace(0.0, 0.25, 500)
    x = 0.04 * np.sin(np.pi * np.clip(time / 0.15, 0.0, 1.0))
    return ShotPanel(
        title="F_f = 0.21 N",
        time_s=time,
        force_N=30.0 * np.exp(-time / 0.004),
        displacement_m=x,
        velocity_m_s=np.gradient(x, time),
        drive_V=np.where(time < 0.01, 16.0, 0.0),
        stage_ends_s=(0.009, 0.075, landing_s),
        collision_force_N=collision_N,
    )


def saved_as(*kinds: str) -> Callable[[Figure, Path], None]:
    """What saves a figure in these kinds alone, for tests that look at no other."""

    def save(figure: Figure, stem: Path) -> None:
        stem.parent.mkdir(parents=True, exist_ok=True)
        for kind in kinds:
            figure.savefig(f"{stem}.{kind}")

    return save
