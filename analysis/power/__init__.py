"""Power and precision by simulation: the planned analysis of many studies at once, and what it says of a design."""

from analysis.power.planned import Findings, analysed_directions, analysed_ratings
from analysis.power.shares import Option, Precision, Share, Tally, merged, precisions, shares, smallest, tallied

__all__ = [
    "Findings",
    "Option",
    "Precision",
    "Share",
    "Tally",
    "analysed_directions",
    "analysed_ratings",
    "merged",
    "precisions",
    "shares",
    "smallest",
    "tallied",
]
