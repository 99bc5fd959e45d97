"""A method's shot as a panel of Figure 5: from the device's trace to the figure's values."""

from __future__ import annotations

import math

from analysis.report.figures.shot import ShotPanel
from device.parameters import GunParameters
from device.physics import ShotSummary, trace

_COARSE_S = 0.0005  # steps above which a curve is drawn with corners
_MOST_POINTS = 40_000


def shot_panel(title: str, parameters: GunParameters) -> ShotPanel:
    """The panel of one shot by the model."""
    shot = trace(parameters)
    if shot.time_s[-1] - shot.time_s[-2] > _COARSE_S:
        shot = trace(parameters, min(int(2 * shot.time_s[-1] / _COARSE_S), _MOST_POINTS))
    return ShotPanel(
        title=title,
        time_s=shot.time_s,
        force_N=shot.force_N,
        displacement_m=shot.displacement_m,
        velocity_m_s=shot.velocity_m_s,
        drive_V=shot.drive_V,
        stage_ends_s=_ends(shot.summary),
        collision_force_N=_or_nan(shot.summary.collision_force_N),
        contact_depth_m=parameters.contact_depth_m,
        status=shot.summary.status,
    )


def _ends(summary: ShotSummary) -> tuple[float, float, float]:
    return _or_nan(summary.recoil_end_s), _or_nan(summary.firing_end_s), _or_nan(summary.reset_end_s)


def _or_nan(value: float | None) -> float:
    return math.nan if value is None else value
