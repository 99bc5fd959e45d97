"""Log tables into the statistics, figures and report of a paper. Importing this loads numpy and scipy, nothing more."""

from analysis.stats.anova import Anova, RepeatedMeasuresAnova, one_way_anova, rm_anova
from analysis.stats.binomial import BinomialTest, binomial_test
from analysis.stats.detection import Detection, yes_no
from analysis.stats.studentized_range import studentized_range_isf, studentized_range_logsf, studentized_range_sf
from analysis.stats.tukey import Comparison, rm_tukey_hsd, rm_tukey_hsd_paired, tukey_hsd

__all__ = [
    "Anova",
    "BinomialTest",
    "Comparison",
    "Detection",
    "RepeatedMeasuresAnova",
    "binomial_test",
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
