"""Who was left out and which trials were dropped, in the words of a paper: people, not entries, and no rule's key."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping

from analysis.logs.design_logs import ONE_DESIGN
from analysis.logs.exclusion_rules import BY_HAND
from analysis.logs.exclusions import FINISHED, IN_NO_TEST, NOT_COUNTED, LeftOut
from analysis.logs.kinds import IN_REGISTER, NEVER_TOGETHER
from analysis.report import apa
from analysis.report.labels import named
from analysis.summary.results import RulesApplied
from analysis.summary.sections.content import ReportData
from device.messages import how_many

_REASONS = 5
"""So many reasons of exclusion are told."""
_WORDS = {
    "every trial is answered": "for unanswered trials",
    "every method is rated": "for a missing rating",
    "everybody has every method": "for lack of a method",
    NOT_COUNTED[0]: "for lack of forward trials",
    ONE_DESIGN: "for a run of another design",
    "min_kept_share": "for too few trials kept{}",
    "max_same_response_share": "for giving the same answer too often{}",
    "accuracy": "for too few right answers{}",
}
_UNUSABLE = "for a log that could not be used"
_TRIALS = {
    "drop_flags": "with the flag {}",
    "response_time_min_s": "with a response time below {} s",
    "response_time_max_s": "with a response time above {} s",
    "drop_unanswered": "without an answer",
}


def people_left_out(report: ReportData, experiment: str, analysed: frozenset[str]) -> str:
    """A sentence on who took part and was not analysed; each person once, with the first reason.

    Runs of synthetic participants are nobody, and who has only begun is counted apart.
    """
    gone = {one.participant: one for one in reversed(_entries(report, experiment)) if one.participant not in analysed}
    begun = sum(one.rule == FINISHED for one in gone.values())
    left = Counter(_reason(report, one) for one in gone.values() if one.rule != FINISHED)
    parts = [_left_out(left)] if left else []
    parts += [f"{how_many(begun, 'participant')} had begun and not finished."] if begun else []
    if any(one.rule == IN_NO_TEST for one in _entries(report, experiment)):
        return " ".join([*parts, "Whoever lacked an answer to a question in some condition was left out of its tests."])
    return " ".join(parts) or "Nobody was left out."


def _entries(report: ReportData, experiment: str) -> list[LeftOut]:
    entries = report.statistics.excluded
    return [one for one in entries if one.experiment == experiment and one.participant and one.rule != NEVER_TOGETHER]


def _left_out(reasons: Counter[str]) -> str:
    told = ", ".join(f"{count:,} {reason}" for reason, count in reasons.most_common(_REASONS))
    rest = reasons.total() - sum(count for _, count in reasons.most_common(_REASONS))
    more = f", {rest:,} for other reasons, which the report lists" if rest else ""
    verb = "was" if reasons.total() == 1 else "were"
    return f"{how_many(reasons.total(), 'further participant')} {verb} left out: {told}{more}."


def _reason(report: ReportData, one: LeftOut) -> str:
    """Why somebody was left out; by hand with what the experimenters said."""
    if one.rule == BY_HAND:
        return f"by hand ({one.reason})"
    if one.rule == IN_REGISTER:
        member = report.members.get(one.participant)
        return f"by hand ({member.excluded})" if member and member.excluded else "by hand"
    if one.rule not in _WORDS:
        return _UNUSABLE if one.file else one.reason
    bound = _bound(one.rule, report.statistics.rules)
    return _WORDS[one.rule].format(f" ({bound})" if bound else "")


def _bound(rule: str, rules: RulesApplied | None) -> str:
    """What a rule asks for."""
    if rules is None or rule not in {"min_kept_share", "max_same_response_share", "accuracy"}:
        return ""
    if rule == "accuracy":
        asked = (f"{apa.percent(one['min_share'], 0)} with {named(one['method'])}" for one in rules.config["accuracy"])
        return f"fewer than {' or '.join(asked)}"
    share = rules.config["participants"][rule]
    if share is None:
        return "none"  # who has no trial left is gone without a rule
    return f"{'fewer' if rule == 'min_kept_share' else 'more'} than {apa.percent(share, 0)} of them"


def trials_dropped(report: ReportData, experiment: str) -> str:
    """A sentence on the trials that rules dropped; empty without rules."""
    rules = report.statistics.rules
    if rules is None or experiment not in rules.trials:
        return ""
    counts = dropped_by_rule(rules.dropped.get(experiment, {}))
    recorded, gone = rules.trials[experiment].recorded, counts.total()
    if not gone:
        return f"The rules of exclusion dropped none of {how_many(recorded, 'trial')}."
    told = ", ".join(f"{count:,} {rule}" for rule, count in _trial_words(rules, counts))
    share, were = apa.percent(gone / recorded), "was" if gone == 1 else "were"
    trials = "planned trial" if report.stopped.get(experiment) else "recorded trial"  # not all of them took place
    return f"Of {how_many(recorded, trials)} {gone:,} ({share}) {were} dropped: {told}."


def dropped_by_rule(people: Mapping[str, Mapping[str, int]]) -> Counter[str]:
    """How many trials each rule dropped, of everybody together."""
    counts = Counter[str]()
    for by_rule in people.values():
        counts.update(by_rule)
    return counts


def _trial_words(rules: RulesApplied, counts: Counter[str]) -> Iterator[tuple[str, int]]:
    asked = rules.config["trials"]
    for rule, count in sorted(counts.items()):
        value = asked.get(rule)
        shown = " or ".join(value) if isinstance(value, list | tuple) else f"{value:g}" if value is not None else ""
        yield _TRIALS[rule].format(shown), count
