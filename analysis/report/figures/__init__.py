"""The paper's two result figures and what stands beside them, drawn from plain values.

matplotlib enters the project's analysis here alone.
"""

from analysis.summary.figures.directions import figure_directions
from analysis.report.figures.names import display_name, named, people, stars
from analysis.summary.figures.results import figure_8
from analysis.report.figures.shot import ShotPanel, figure_5
from analysis.summary.figures.times import figure_response_times
from analysis.summary.figures.trade import (
    figure_conditional_accuracy,
    figure_quantile_probability,
    has_curve,
    has_points,
)
from analysis.report.figures.vibration import VibrationPanel, figure_vibration

__all__ = [
    "ShotPanel",
    "VibrationPanel",
    "display_name",
    "figure_5",
    "figure_8",
    "figure_conditional_accuracy",
    "figure_directions",
    "figure_quantile_probability",
    "figure_response_times",
    "figure_vibration",
    "has_curve",
    "has_points",
    "named",
    "people",
    "stars",
]
