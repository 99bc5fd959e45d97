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
    from analysis.stats.anova_bayes import one_way_bayes_factor, rm_anova_bayes_factor
    from analysis.stats.anova_power import cohens_f, one_way_anova_power, rm_anova_power
    from analysis.stats.binomial import (
        BinomialTest,
        Detection,
        binomial_test,
        binomial_test_log_p,
        binomial_test_p,
        yes_no,
    )
    from analysis.stats.contrasts import planned_contrasts
    from analysis.stats.corrections import benjamini_hochberg, holm
    from analysis.stats.equivalence import tost_one_sample, tost_paired, tost_two_samples
    from analysis.stats.fixed_effects import indicators
    from analysis.stats.mixed_model import linear_mixed_model
    from analysis.stats.random_intercept import random_intercept_logit

_NAMES = {
    "anova": (
        "Anova Comparison RepeatedMeasuresAnova one_way_anova rm_anova rm_tukey_hsd rm_tukey_hsd_paired "
        "studentized_range_isf studentized_range_logsf studentized_range_sf tukey_hsd"
    ),
    "anova_bayes": "one_way_bayes_factor rm_anova_bayes_factor",
    "anova_power": "cohens_f one_way_anova_power rm_anova_power",
    "binomial": "BinomialTest Detection binomial_test binomial_test_log_p binomial_test_p yes_no",
    "contrasts": "planned_contrasts",
    "corrections": "benjamini_hochberg holm",
    "equivalence": "tost_one_sample tost_paired tost_two_samples",
    "fixed_effects": "indicators",
    "mixed_model": "linear_mixed_model",
    "random_intercept": "random_intercept_logit",
}
_HOMES = {name: module for module, names in _NAMES.items() for name in names.split()}

__all__ = [
    "Anova",
    "BinomialTest",
    "Comparison",
    "Detection",
    "RepeatedMeasuresAnova",
    "benjamini_hochberg",
    "binomial_test",
    "binomial_test_log_p",
    "binomial_test_p",
    "cohens_f",
    "holm",
    "indicators",
    "linear_mixed_model",
    "one_way_anova",
    "one_way_anova_power",
    "one_way_bayes_factor",
    "planned_contrasts",
    "random_intercept_logit",
    "rm_anova",
    "rm_anova_bayes_factor",
    "rm_anova_power",
    "rm_tukey_hsd",
    "rm_tukey_hsd_paired",
    "studentized_range_isf",
    "studentized_range_logsf",
    "studentized_range_sf",
    "tost_one_sample",
    "tost_paired",
    "tost_two_samples",
    "tukey_hsd",
    "yes_no",
]


def __getattr__(name: str) -> object:
    if name not in _HOMES:
        raise AttributeError(f"module 'analysis' has no attribute {name!r}; it has {', '.join(__all__)}")
    return getattr(import_module(f"analysis.stats.{_HOMES[name]}"), name)
