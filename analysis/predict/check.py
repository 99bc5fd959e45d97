"""`recoil check`: what a config means, without running anything: design, orders, duration, drive and limits."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from pathlib import Path

from analysis.paper.paper import load_paper
from analysis.predict.check_design import DesignCheck, check_design, design_sections
from analysis.report.section import Section
from analysis.report.serial import plain
from analysis.report.terminal import in_text, with_tables
from experiments.config.door import ConfigError, EligibilityConfig, at_key, participant_codes, read_toml
from experiments.config.setup import Setup
from experiments.design.config import DesignConfig
from experiments.load import check_methods, find, load_gun, load_setup, load_study

EXAMPLE_SEED = 1
"""Orders are shown for this seed if the config gives none; a run without a seed draws its own."""


@dataclass(frozen=True, slots=True, kw_only=True)
class StudyCheck:
    """What the config of a study means."""

    study: str
    participants: int
    eligibility: EligibilityConfig
    experiments: tuple[DesignCheck, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class GunCheck:
    """What the config of a gun holds."""

    gun: str
    methods: tuple[str, ...]
    assumed: tuple[str, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class PaperCheck:
    """What a paper's file holds: the participants of its experiments."""

    paper: str
    experiments: dict[str, int]


AnyCheck = DesignCheck | StudyCheck | GunCheck | PaperCheck


def check(name: str, seed: int | None, participants: int) -> AnyCheck:
    """What any config means. `ConfigError` names what is wrong with it."""
    path = find(name)
    table = read_toml(path)
    if "design" in table or "factors" in table:
        return _design(load_setup(name), seed, participant_codes(participants))
    if "experiments" in table:
        return _study(name, seed)
    if "methods" in table and "voice_coil" in table:
        gun = load_gun(path)
        check_methods(gun, tuple(gun.methods), path)
        return GunCheck(gun=gun.title, methods=tuple(gun.methods), assumed=tuple(gun.assumed))
    if not {"direction", "preference", "paper"} & set(table):
        raise ConfigError(f"{path}: no config that is known: neither a design, a study, a gun nor a paper's numbers")
    paper = load_paper(path)
    return PaperCheck(paper=path.name, experiments={"direction": paper.direction.n, "preference": paper.preference.n})


def _study(name: str, seed: int | None) -> StudyCheck:
    study, folder = load_study(name)
    if study.paper is not None:
        _check_paper(find(name), folder / study.paper)
    setups = [load_setup(folder / experiment) for experiment in study.experiments]
    return StudyCheck(
        study=study.title,
        participants=study.participants,
        eligibility=study.eligibility,
        experiments=tuple(_design(setup, seed, study.codes()) for setup in setups),
    )


def _check_paper(study: Path, paper: Path) -> None:
    """`ConfigError`: the numbers that a study is to be compared with are not there, or are none."""
    if not paper.is_file():
        raise ConfigError(at_key(study, f"paper = {paper.name!r}: no such file beside the study; leave the key out"))
    load_paper(paper)


def _design(setup: Setup[DesignConfig], seed: int | None, codes: Sequence[str]) -> DesignCheck:
    chosen = next((one for one in (seed, setup.config.seed) if one is not None), EXAMPLE_SEED)
    return check_design(setup, chosen, codes)


def check_text(found: AnyCheck) -> str:
    """What was found, for a person."""
    if isinstance(found, GunCheck | PaperCheck):
        return "\n".join(f"{one.name}: {plain(getattr(found, one.name))}" for one in fields(found))
    return "\n\n".join(with_tables(one) if one.tables else in_text(one) for one in sections(found))


def sections(found: DesignCheck | StudyCheck) -> tuple[Section, ...]:
    """What a config means: sections for each design, that of the study before them."""
    if isinstance(found, DesignCheck):
        return design_sections(found)
    asked = found.eligibility.model_dump(mode="json", exclude_none=True)
    rules = ", ".join(f"{key} {value}" for key, value in asked.items() if value)
    title = f"Study: {found.study}, {found.participants} participants; eligibility: {rules or 'everyone'}"
    return Section(title=title), *(section for one in found.experiments for section in sections(one))
