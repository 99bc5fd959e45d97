"""The figures of the two experiments, drawn from plain values."""

import analysis.report.figures  # noqa: F401 - before any other part of matplotlib
