"""Log tables into the statistics, figures and report of a paper. The tests of the core are named here.

They are looked up when they are used: importing this loads nothing, a test loads numpy and scipy.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from analysis.stats.anova import (
        Anova,
        Comparison,
        RepeatedMeasuresAnova,
        one_way_anova,
        rm_anova,
        rm_tukey_hsd,
        rm_tukey_hsd_paired,
        studentized_range_isf,
        studentized_range_logsf,
        studentized_range_sf,
        tukey_hsd,
    )
    from analysis.stats.binomial import (
        BinomialTest,
        Detection,
        binomial_test,
        binomial_test_log_p,
        binomial_test_p,
        yes_no,
    )

__all__ = [
    "Anova",
    "BinomialTest",
    "Comparison",
    "Detection",
    "RepeatedMeasuresAnova",
    "binomial_test",
    "binomial_test_log_p",
    "binomial_test_p",
    "one_way_anova",
    "rm_anova",
    "rm_tukey_hsd",
    "rm_tukey_hsd_paired",
    "studentized_range_isf",
    "studentized_range_logsf",
    "studentized_range_sf",
    "tukey_hsd",
    "yes_no",
]

_MODULES = ("anova", "binomial")


def __getattr__(name: str) -> object:
    if name not in __all__:
        raise AttributeError(f"module 'analysis' has no attribute {name!r}; it has {', '.join(__all__)}")
    modules = (import_module(f"analysis.stats.{module}") for module in _MODULES)
    return next(getattr(module, name) for module in modules if getattr(module, name, None) is not None)
