"""The paper's two result figures and what stands beside them, drawn from plain values.

matplotlib enters the project's analysis here alone.
"""

from analysis.report.figures.directions import figure_directions
from analysis.report.figures.names import display_name, named, people, stars
from analysis.report.figures.results import figure_8
from analysis.report.figures.shot import ShotPanel, figure_5
from analysis.report.figures.times import figure_response_times

__all__ = [
    "ShotPanel",
    "display_name",
    "figure_5",
    "figure_8",
    "figure_directions",
    "figure_response_times",
    "named",
    "people",
    "stars",
]
