"""A method's shot as a panel of Figure 5: from the device's trace to the figure's values."""

from __future__ import annotations

import math

from analysis.report.figures import ShotPanel
from device.parameters import GunParameters
from device.physics import ShotSummary, trace


def shot_panel(title: str, parameters: GunParameters) -> ShotPanel:
    """The panel of one shot by the model."""
    shot = trace(parameters)
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
    )


def _ends(summary: ShotSummary) -> tuple[float, float, float]:
    return _or_nan(summary.recoil_end_s), _or_nan(summary.firing_end_s), _or_nan(summary.reset_end_s)


def _or_nan(value: float | None) -> float:
    return math.nan if value is None else value
