"""Are published numbers attainable and consistent? Exact checks of what a paper prints, and the audit of a whole one.

"not attainable" is said by proof only, "attainable" only with data that give the number; else "undecided".
`reconstruct` finds data that meet many printed numbers at once.
"""

from analysis.audit.annealing import Order
from analysis.audit.binomial_p import binomial_p
from analysis.audit.freedom import degrees_of_freedom
from analysis.audit.means import grim, percent_of_count, scale_of
from analysis.audit.p_values import p_against_statistic
from analysis.audit.paper_file import PaperFile, load_paper_file, parse_paper
from analysis.audit.printed import Interval, PrintedNumber, Rounding, read
from analysis.audit.reconstruct import Constraints, Reconstruction, printed_constraints, reconstruct
from analysis.audit.registry import CHECKS
from analysis.audit.run import Finding, audit
from analysis.audit.spreads import debit, grimmer
from analysis.audit.totals import Term, total
from analysis.audit.tukey_pattern import Comparison, tukey_pattern
from analysis.audit.variance_ratios import between_f, repeated_f
from analysis.audit.words import Result, Verdict

__all__ = [
    "CHECKS",
    "Comparison",
    "Constraints",
    "Finding",
    "Interval",
    "Order",
    "PaperFile",
    "PrintedNumber",
    "Reconstruction",
    "Result",
    "Rounding",
    "Term",
    "Verdict",
    "audit",
    "between_f",
    "binomial_p",
    "debit",
    "degrees_of_freedom",
    "grim",
    "grimmer",
    "load_paper_file",
    "p_against_statistic",
    "parse_paper",
    "percent_of_count",
    "printed_constraints",
    "read",
    "reconstruct",
    "repeated_f",
    "scale_of",
    "total",
    "tukey_pattern",
]
