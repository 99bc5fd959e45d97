"""The paper's two result figures, drawn from plain values. matplotlib enters the project's analysis here alone."""

from analysis.figures.results import display_name, figure_8, named, stars
from analysis.figures.shot import ShotPanel, figure_5

__all__ = ["ShotPanel", "display_name", "figure_5", "figure_8", "named", "stars"]
