"""Are published numbers attainable and consistent? Exact checks of what a paper prints, and the audit of a whole one.

"not attainable" is said by proof only, "attainable" only with data that give the number; else "undecided".
"""

from analysis.audit.binomial_p import binomial_p
from analysis.audit.freedom import degrees_of_freedom
from analysis.audit.means import grim, percent_of_count
from analysis.audit.p_values import p_against_statistic
from analysis.audit.paper_file import PaperFile, load_paper_file, parse_paper
from analysis.audit.printed import Interval, PrintedNumber, Rounding, read
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
    "Finding",
    "Interval",
    "PaperFile",
    "PrintedNumber",
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
    "read",
    "repeated_f",
    "total",
    "tukey_pattern",
]
