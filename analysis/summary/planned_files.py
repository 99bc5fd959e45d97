"""The further files that a study has set beforehand, each checked as `recoil analyze` will read it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from analysis.logs.exclusion_rules import Rules, methods_with_right_answers, without_trials_of
from analysis.paper.paper import load_paper
from analysis.summary.remarks_coding import load_codebook
from analysis.summary.request_data import planned_names, unit_of_bounds
from analysis.summary.requests import LOGARITHMS, AnyRequest, EquivalenceRequest, Requests, check_names, ratios
from experiments.config.door import ConfigError, StudyConfig, at_key, load
from experiments.design.config import DesignConfig


@dataclass(frozen=True, slots=True, kw_only=True)
class PlannedFiles:
    """The rules and the further tests that are set beforehand."""

    rules: Rules | None = None
    requests: tuple[AnyRequest, ...] = ()


def planned_files(source: Path, study: StudyConfig, designs: Sequence[DesignConfig]) -> PlannedFiles:
    """The files that a study names beside it. `ConfigError`: they are not in order, or name what no design has."""
    own, names = study.preregistration, {"paper": study.paper}
    names |= {key: getattr(own, key) for key in ("rules", "requests", "codebook")}
    files = {key: _file(source, key, name) for key, name in names.items() if name is not None}
    if "paper" in files:
        load_paper(files["paper"])
    if "codebook" in files:
        load_codebook(files["codebook"])
    rules = load(Rules, files["rules"]) if "rules" in files else None
    requests = load(Requests, files["requests"]).requests if "requests" in files else ()
    faults = [] if rules is None else [at_key(files["rules"], one) for one in _faults_of_rules(rules, designs)]
    faults += [at_key(files["requests"], one) for one in _faults_of_requests(requests, designs)]
    if faults:
        raise ConfigError("\n".join(faults))
    return PlannedFiles(rules=rules, requests=requests)


def bounds_told(requests: Sequence[AnyRequest], designs: Sequence[DesignConfig]) -> Iterator[str]:
    """In what unit the bounds of each equivalence test are, which a file of requests does not say."""
    known = {design.design: design for design in designs}
    for one in requests:
        if isinstance(one, EquivalenceRequest):
            unit = unit_of_bounds(known[one.of], one.question)
            of = one.of if one.question is None else f"{one.of}, {one.question}"
            more = f": {ratios(one)}" if unit == LOGARITHMS else ""
            yield f"{of}: low = {one.low:g} and high = {one.high:g} of the equivalence test are in {unit}{more}"


def _file(source: Path, key: str, name: str) -> Path:
    path = source.parent / name
    if not path.is_file():
        place = key if key == "paper" else f"preregistration.{key}"
        rule = f"{place} = {name!r}: no such file beside the study; write it, or leave the key out"
        raise ConfigError(at_key(source, rule))
    return path


def _faults_of_rules(rules: Rules, designs: Sequence[DesignConfig]) -> Iterator[str]:
    methods = methods_with_right_answers(designs)
    for place, method in without_trials_of(rules, methods):
        rule = f"no design of this study has right answers with it; there are {', '.join(methods) or 'none'}"
        yield f"accuracy.{place}.method = {method!r}: {rule}"


def _faults_of_requests(requests: Sequence[AnyRequest], designs: Sequence[DesignConfig]) -> Iterator[str]:
    known = {design.design: design for design in designs}
    for place, request in enumerate(requests):
        if request.of not in known:
            there = ", ".join(known)
            yield f"requests.{place}.of = {request.of!r}: no experiment of this study; it has {there}"
            continue
        try:
            check_names(request, planned_names(known[request.of], request.question))
        except ValueError as error:
            yield f"requests.{place}: {error}"
