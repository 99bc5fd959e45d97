"""The checks by name, for a file to call."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType

from analysis.paper.audit.binomial_p import binomial_p
from analysis.paper.audit.freedom import degrees_of_freedom
from analysis.paper.audit.means import grim, percent_of_count
from analysis.paper.audit.p_values import p_against_statistic
from analysis.paper.audit.spreads import debit, grimmer
from analysis.paper.audit.totals import total
from analysis.paper.audit.tukey_pattern import tukey_pattern
from analysis.paper.audit.variance_ratios import between_f, repeated_f
from analysis.paper.audit.words import Result

CHECKS: Mapping[str, Callable[..., Result]] = MappingProxyType(
    {
        "grim": grim,
        "percent": percent_of_count,
        "grimmer": grimmer,
        "debit": debit,
        "df": degrees_of_freedom,
        "p": p_against_statistic,
        "binomial": binomial_p,
        "repeated-f": repeated_f,
        "between-f": between_f,
        "tukey": tukey_pattern,
        "total": total,
    }
)
"""Name in a paper's file -> check; a claim's other keys are the check's arguments (`paper_file` types them)."""
