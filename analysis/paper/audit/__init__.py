"""Are published numbers attainable and consistent? Exact checks of what a paper prints, and the audit of a whole one.

"not attainable" is said by proof only, "attainable" only with data that give the number; else "undecided".
`reconstruct` finds data that meet many printed numbers at once.
"""

from analysis.paper.audit.claims import CHECKS, AuditFinding
from analysis.paper.audit.freedom import Term, degrees_of_freedom, total
from analysis.paper.audit.means import debit, grim, grimmer, percent_of_count, scale_of
from analysis.paper.audit.p_values import binomial_p, p_against_statistic
from analysis.paper.audit.printed import AuditVerdict, CheckResult, Interval, PrintedNumber, Rounding, read_printed
from analysis.paper.audit.reconstruct import ColumnOrder, Constraints, Reconstruction, printed_constraints, reconstruct
from analysis.paper.audit.run import PaperFile, audit, load_paper_file, parse_paper
from analysis.paper.audit.tukey_pattern import ClaimedComparison, tukey_pattern
from analysis.paper.audit.variance_ratios import between_f, repeated_f

__all__ = [
    "CHECKS",
    "AuditFinding",
    "AuditVerdict",
    "CheckResult",
    "ClaimedComparison",
    "ColumnOrder",
    "Constraints",
    "Interval",
    "PaperFile",
    "PrintedNumber",
    "Reconstruction",
    "Rounding",
    "Term",
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
    "read_printed",
    "reconstruct",
    "repeated_f",
    "scale_of",
    "total",
    "tukey_pattern",
]
