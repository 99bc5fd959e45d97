"""A preregistration in words: hypotheses, people, designs, exclusions and tests, as Markdown."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from analysis.logs.exclusion_rules import Rules, TrialRules
from analysis.summary.announced import sentences_of_tests
from analysis.summary.planned_files import bounds_told
from analysis.summary.requests import AnyRequest
from experiments.config.door import EligibilityConfig, StudyConfig
from experiments.config.setup import Setup
from experiments.design.config import DesignConfig
from experiments.design.methods_section import joined_by_and, methods_section
from experiments.design.planned import runs_of_groups
from experiments.study.changes import KeyChange, plain_value
from experiments.study.preregistration import Preregistration


@dataclass(frozen=True, slots=True, kw_only=True)
class Planned:
    """What is set beforehand: the study, its designs with their guns, the rules and the further tests."""

    study: StudyConfig
    setups: tuple[Setup[DesignConfig], ...]
    rules: Rules | None = None
    requests: tuple[AnyRequest, ...] = ()


def page(one: Preregistration, planned: Planned) -> str:
    """All that is frozen, for people."""
    title = f"# Preregistration {one.number}: {planned.study.title}"
    parts = [title, *_head(one), *_changes(one.changes), *_hypotheses(planned), *_sample(planned)]
    for setup in planned.setups:
        parts += _design(setup)
    return "\n\n".join([*parts, *_exclusions(planned), *_tests(planned), *_files(one)]) + "\n"


def _head(one: Preregistration) -> Iterator[str]:
    commit = one.provenance.get("git_commit", "none")
    at = "" if commit in ("none", "unknown") else f" (commit {commit})"
    yield f"Written {one.written_utc} (UTC) with Recoil {one.provenance.get('recoil', 'unknown')}{at}."
    if one.previous is not None:
        why = f"Reason: {one.reason}" if one.reason else "No reason was given."
        yield f"Amends preregistration {one.number - 1} with the SHA-256 `{one.previous}`. {why}"
    begun = f"Begun before it was written: {', '.join(one.begun)}." if one.begun else "No run of a person had begun."
    yield begun


def _changes(found: Sequence[KeyChange]) -> Iterator[str]:
    if found:
        yield "## What it changes"
        yield _listed([f"`{one.file}` {one.key}{_both(one)}" for one in found])


def _both(one: KeyChange) -> str:
    """Before and after; of a file that is new or gone, neither."""
    return "" if one.is_whole_file else f": before {plain_value(one.frozen)}, from now on {plain_value(one.now)}"


def _listed(items: Sequence[str]) -> str:
    return "\n".join(f"- {item}" for item in items)


def _hypotheses(planned: Planned) -> Iterator[str]:
    yield "## Hypotheses"
    stated = planned.study.preregistration.hypotheses
    yield _listed(stated) if stated else "None is stated."


def _sample(planned: Planned) -> Iterator[str]:
    study = planned.study
    yield "## Participants and stop rule"
    yield f"{study.participants} participants do {joined_by_and([setup.config.title for setup in planned.setups])}."
    yield study.preregistration.stop_rule or (
        f"Nobody comes any more when {study.participants} participants have done everything. Who is excluded in the "
        "register does not count, and a new participant takes their place."
    )
    yield _eligible(study.eligibility)


def _eligible(rules: EligibilityConfig) -> str:
    ages = [
        f"{word} {age} years"
        for word, age in (("at least", rules.age_years_min), ("at most", rules.age_years_max))
        if age is not None
    ]
    parts = [f"aged {' and '.join(ages)}"] if ages else []
    parts += [f"handedness {' or '.join(rules.handedness)}"] if rules.handedness else []
    parts += [f"sex {' or '.join(rules.sex)}"] if rules.sex else []
    return f"Who may take part: {'; '.join(parts)}." if parts else "Everybody may take part."


def _design(setup: Setup[DesignConfig]) -> Iterator[str]:
    yield f"## Design: {setup.config.title} ({setup.config.experiment})"
    yield from methods_section(setup.config, runs_of_groups(setup.config, setup.gun), setup.gun.labels)
    labels = (f"{setup.gun.methods[name].label} ({name})" for name in setup.config.methods)
    yield f"The gun: {setup.gun.title}. Its methods: {', '.join(labels)}."


def _exclusions(planned: Planned) -> Iterator[str]:
    yield "## Exclusions"
    names = [setup.config.experiment for setup in planned.setups]
    yield _listed(
        [
            "Of a run that was stopped before its end counts what was answered, as far as what follows lets it. A run "
            "of which no table was made is not analysed, nor is a practice.",
            "Who is excluded by hand, in the register, is not analysed, and is listed with the reason.",
            *_incomplete(names),
            *(_rules(planned.rules) if planned.rules else ["There are no further rules for trials or participants."]),
        ]
    )


def _incomplete(names: Sequence[str]) -> Iterator[str]:
    if "direction" in names:
        yield "direction: who left a trial unanswered, or has no forward trials with a method, is left out of it."
    if "preference" in names:
        yield "preference: who did not rate every method is left out of it."
    if others := [name for name in names if name not in ("direction", "preference")]:
        yield f"{joined_by_and(others)}: who has no answer in some condition is in no test of that question."


def _rules(rules: Rules) -> Iterator[str]:
    yield from _trial_rules(rules.trials)
    people = rules.participants
    if people.min_kept_share is not None:
        yield f"Who has fewer than {people.min_kept_share:g} of their trials left is left out."
    if people.max_same_response_share is not None:
        yield f"Who gives the same answer in more than {people.max_same_response_share:g} of the trials is left out."
    for accuracy in rules.accuracy:
        yield f"Who is right in fewer than {accuracy.min_share:g} of the trials with {accuracy.method} is left out."
    for listed in rules.excluded:
        yield f"{listed.code} is left out, for a reason that is not published here."


def _trial_rules(trials: TrialRules) -> Iterator[str]:
    if trials.drop_flags:
        yield f"Trials with one of these flags are dropped: {', '.join(trials.drop_flags)}."
    if trials.response_time_min_s is not None:
        yield f"Trials whose response time is below {trials.response_time_min_s:g} s are dropped."
    if trials.response_time_max_s is not None:
        yield f"Trials whose response time is above {trials.response_time_max_s:g} s are dropped."
    if trials.drop_unanswered:
        yield "Trials without an answer are dropped; their participant stays."


def _tests(planned: Planned) -> Iterator[str]:
    yield "## Tests"
    own = planned.study.preregistration
    yield _listed(
        [
            *(sentence for setup in planned.setups for sentence in sentences_of_tests(setup.config)),
            *(f"{one.of}, {_request(one)}." for one in planned.requests),
            *(f"{one}." for one in bounds_told(planned.requests, [setup.config for setup in planned.setups])),
            *(["direction: the diffusion model is fitted to the response times."] if own.fits else []),
            *([f"Free descriptions are coded by {own.codebook}."] if own.codebook else []),
        ]
    )
    yield "All tests are two-sided at α = .05. Whatever else the report shows is a supplement, and exploratory."


_KINDS = {
    "contrasts": "planned contrasts",
    "equivalence": "two one-sided tests of equivalence",
    "bayes-factor": "the Bayes factor of the repeated-measures ANOVA",
    "mixed-model": "a linear mixed model of single trials",
    "logistic": "a logistic mixed model of single answers",
}


def _request(one: AnyRequest) -> str:
    """What is requested, with every value that its file gives."""
    given = one.model_dump(mode="json", exclude={"kind", "of"}, exclude_none=True)
    told = "; ".join(f"{key} {plain_value(value)}" for key, value in given.items())
    return f"{_KINDS[one.kind]}{f' ({told})' if told else ''}"


def _files(one: Preregistration) -> Iterator[str]:
    yield "## What is frozen"
    yield (
        f"Every value of {joined_by_and([f'`{name}`' for name in one.files])}, with all defaults, as it stands in "
        f"`preregistration-{one.number}.json` beside this page. The hash is over that file: values and words."
    )
