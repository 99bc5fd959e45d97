"""What the tests of an experiment take for granted, in plain sentences, and a warning where it does not hold."""

from __future__ import annotations

import math
from collections.abc import Iterator

from analysis.summary.results import (
    Assumption,
    DesignSummary,
    DirectionStatistics,
    PooledBinomial,
    Supplement,
    WithinStatistics,
)
from device.messages import first_few

EPSILON = 0.75
"""Below it the pooled Tukey test is not to be read: its familywise error grows to .064 at .72 and .088 at .45."""
END_SHARE = 0.15
"""Share of participants at an end of the scale that counts as a floor or ceiling effect (Terwee et al. 2007)."""
_ALPHA = 0.05


def assumptions(found: WithinStatistics) -> tuple[Assumption, ...]:
    """The assumptions behind one experiment's tests; none where nothing was tested."""
    if found.supplement is None:
        return ()
    common = (
        _people_independent(),
        _sphericity(found.supplement),
        _normality(found.supplement),
        _ends(found, found.supplement),
        _outliers(found.supplement),
    )
    if isinstance(found, DirectionStatistics):
        return *common, _answers_independent(found), _log_odds(found)
    return common


def _people_independent() -> Assumption:
    return Assumption(assumption="Participants are independent of each other; the design has to see to it.")


def _sphericity(found: Supplement) -> Assumption:
    text = "The uncorrected F test and the pooled Tukey test take all differences of two methods to vary alike."
    corrected = found.sphericity.greenhouse_geisser
    if corrected is None or corrected.epsilon >= EPSILON:
        return Assumption(assumption=text)
    warning = (
        f"sphericity does not hold (Greenhouse-Geisser epsilon below {EPSILON}): read the corrected F test and "
        "the Tukey test with each pair's own error (tukey_paired), not the pooled one"
    )
    return Assumption(assumption=text, warning=warning, serious=True)


def _normality(found: Supplement) -> Assumption:
    text = "The residuals of the ANOVA are normal; F and t tests of means hardly mind small departures."
    p = found.diagnostics.normality.test.p
    departs = p is not None and p < _ALPHA
    warning = (
        f"the residuals depart from normal (Shapiro-Wilk p < {_ALPHA}): see the Friedman test" if departs else None
    )
    return Assumption(assumption=text, warning=warning)


def _ends(found: WithinStatistics, beside: Supplement) -> Assumption:
    n, diagnostics = found.n, beside.diagnostics
    hit = [
        f"{method} ({end} {counts[method]} of {n})"
        for end, counts in (("floor", diagnostics.floor), ("ceiling", diagnostics.ceiling))
        for method in found.methods
        if counts[method] > END_SHARE * n
    ]
    warning = f"participants score at an end of the scale, which shrinks variances: {', '.join(hit)}" if hit else None
    return Assumption(assumption="The scale leaves room at both ends for every participant.", warning=warning)


def _outliers(found: Supplement) -> Assumption:
    people = sorted({outlier.participant for outlier in found.diagnostics.outliers.found})
    warning = f"participants with a score far from the others' (kept): {first_few(people, 5)}" if people else None
    return Assumption(assumption="No single participant decides a mean.", warning=warning)


def _answers_independent(found: DirectionStatistics) -> Assumption:
    tests = {f"{method} {name}": test for method, some in found.binomial.items() for name, test in some.items()}
    turned = [name for name, test in tests.items() if _turned(test)]
    few = [name for name, test in tests.items() if _unsure(test) and name not in turned]
    warnings = []
    if turned:
        said = "people differ so much that the pooled binomial test is not to be read"
        warnings.append(f"{said}: {', '.join(turned)}")
    if few:
        said = "people are too few for the test that allows for their differences to confirm the pooled binomial test"
        warnings.append(f"{said}: {', '.join(few)}")
    text = "The pooled binomial tests take all answers as independent; the clustering in people stands beside each."
    return Assumption(assumption=text, warning="; ".join(warnings) or None, serious=bool(turned))


def _unsure(pooled: PooledBinomial) -> bool:
    """Is the pooled p below .05, and the one that allows for clustering, on t with few degrees of freedom, not?"""
    adjusted = pooled.clustering.p_adjusted
    return adjusted is not None and bool(pooled.p < _ALPHA <= adjusted)


def _turned(pooled: PooledBinomial) -> bool:
    """Does the design effect alone, were there ever so many people, take the pooled p from below .05 to above?"""
    effect = pooled.clustering.design_effect
    if not _unsure(pooled) or effect is None or effect <= 1.0:
        return False
    z = abs(pooled.estimate - 0.5) * math.sqrt(4.0 * pooled.trials / effect)
    return math.erfc(z / math.sqrt(2.0)) >= _ALPHA


def _log_odds(found: DirectionStatistics) -> Assumption:
    model = found.model.fit
    text = "The logistic model takes every method to have right and wrong answers, enough of both."
    warning = f"there is no logistic model. {model.reason.rstrip('.')}" if model.reason else None
    if model.few:
        warning = f"fewer than 5 right or wrong answers, so its tests are unreliable: {', '.join(map(str, model.few))}"
    return Assumption(assumption=text, warning=warning)


def not_spherical(name: str, design: DesignSummary) -> Iterator[str]:
    """A warning for each test of a design whose differences vary so unlike each other that its own p misleads."""
    for question, found in design.questions.items():
        for test in found.tests:
            if test.epsilon is not None and test.p_gg is not None and test.epsilon < EPSILON:
                pairs = "; Tukey's test of pairs takes sphericity too" if found.compared else ""
                yield (
                    f"{name}, {question}, {test.effect}: sphericity does not hold (Greenhouse-Geisser epsilon "
                    f"{test.epsilon:.3g}, below {EPSILON}): read the corrected p = {test.p_gg:.2g}{pairs}"
                )
