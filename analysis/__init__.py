"""Log tables into the statistics, figures and report of a paper. The statistics that a notebook wants are named here.

    from analysis import rm_anova, rm_tukey_hsd, wide

    ratings = wide(trials, participant="participant_id", condition="method", score="rating")
    rm_anova(ratings).F, rm_tukey_hsd(ratings).to_frame()

Scores are arrays or lists of participants by conditions, DataFrames of such rows and columns, or mappings from a
condition to its scores; names stay. Results are frozen, with `to_frame()`, `to_dict()` and a table in a notebook.
Names are looked up when they are used: importing this loads nothing, a test loads numpy and scipy.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from analysis.psychometric.fit import psychometric_fit
    from analysis.psychometric.paired import circular_triads, paired_scores
    from analysis.psychometric.pooling import pooled_group
    from analysis.stats.anova import (
        Anova,
        Comparison,
        RepeatedMeasuresAnova,
        one_way_anova,
        rm_anova,
        rm_tukey_hsd,
        rm_tukey_hsd_paired,
        tukey_hsd,
    )
    from analysis.stats.anova_bayes import one_way_bayes_factor, rm_anova_bayes_factor
    from analysis.stats.anova_power import cohens_f, one_way_anova_power, rm_anova_power
    from analysis.stats.binomial import BinomialTest, binomial_test, binomial_test_log_p, binomial_test_p
    from analysis.stats.contrasts import planned_contrasts
    from analysis.stats.corrections import benjamini_hochberg, holm
    from analysis.stats.diagnostics import cousineau_morey, effect_size, normality, outliers, sphericity
    from analysis.stats.discrimination import Detection, discrimination, yes_no
    from analysis.stats.equivalence import tost_one_sample, tost_paired, tost_two_samples
    from analysis.stats.factorial import factorial_anova
    from analysis.stats.fixed_effects import indicators
    from analysis.stats.frames import groups_of, wide
    from analysis.stats.logit_model import clustering, logit_model
    from analysis.stats.mixed_model import linear_mixed_model
    from analysis.stats.paired import friedman, jzs_paired, paired_t_tests, signed_rank_tests
    from analysis.stats.random_intercept import random_intercept_logit
    from analysis.stats.studentized_range import studentized_range_isf, studentized_range_logsf, studentized_range_sf

_NAMES = {
    "anova": "Anova Comparison RepeatedMeasuresAnova one_way_anova rm_anova rm_tukey_hsd rm_tukey_hsd_paired tukey_hsd",
    "anova_bayes": "one_way_bayes_factor rm_anova_bayes_factor",
    "anova_power": "cohens_f one_way_anova_power rm_anova_power",
    "binomial": "BinomialTest binomial_test binomial_test_log_p binomial_test_p",
    "contrasts": "planned_contrasts",
    "corrections": "benjamini_hochberg holm",
    "diagnostics": "cousineau_morey effect_size normality outliers sphericity",
    "discrimination": "Detection discrimination yes_no",
    "equivalence": "tost_one_sample tost_paired tost_two_samples",
    "factorial": "factorial_anova",
    "fixed_effects": "indicators",
    "frames": "groups_of wide",
    "logit_model": "clustering logit_model",
    "mixed_model": "linear_mixed_model",
    "paired": "friedman jzs_paired paired_t_tests signed_rank_tests",
    "random_intercept": "random_intercept_logit",
    "studentized_range": "studentized_range_isf studentized_range_logsf studentized_range_sf",
}
_PSYCHOMETRIC = {
    "fit": "psychometric_fit",
    "paired": "circular_triads paired_scores",
    "pooling": "pooled_group",
}
_HOMES = {
    name: f"analysis.{room}.{module}"
    for room, modules in (("stats", _NAMES), ("psychometric", _PSYCHOMETRIC))
    for module, names in modules.items()
    for name in names.split()
}

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
    "circular_triads",
    "clustering",
    "cohens_f",
    "cousineau_morey",
    "discrimination",
    "effect_size",
    "factorial_anova",
    "friedman",
    "groups_of",
    "holm",
    "indicators",
    "jzs_paired",
    "linear_mixed_model",
    "logit_model",
    "normality",
    "one_way_anova",
    "one_way_anova_power",
    "one_way_bayes_factor",
    "outliers",
    "paired_scores",
    "paired_t_tests",
    "planned_contrasts",
    "pooled_group",
    "psychometric_fit",
    "random_intercept_logit",
    "rm_anova",
    "rm_anova_bayes_factor",
    "rm_anova_power",
    "rm_tukey_hsd",
    "rm_tukey_hsd_paired",
    "signed_rank_tests",
    "sphericity",
    "studentized_range_isf",
    "studentized_range_logsf",
    "studentized_range_sf",
    "tost_one_sample",
    "tost_paired",
    "tost_two_samples",
    "tukey_hsd",
    "wide",
    "yes_no",
]


def __getattr__(name: str) -> object:
    if name not in _HOMES:
        raise AttributeError(f"module 'analysis' has no attribute {name!r}; it has {', '.join(__all__)}")
    return getattr(import_module(_HOMES[name]), name)


def __dir__() -> list[str]:
    return __all__
