"""`recoil check`: what a config means, without running anything: design, orders, duration, drive and limits."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass, field, fields, replace
from pathlib import Path

from analysis.predict.check_design import AS_FROZEN, DesignCheck, check_design, design_sections
from analysis.report.section import Section
from analysis.report.serial import UNWRITTEN, plain
from analysis.report.terminal import in_text, with_tables
from device.messages import how_many
from experiments.config.door import ConfigError, EligibilityConfig, at_key, participant_codes, read_toml
from experiments.config.setup import Setup
from experiments.design.config import DesignConfig
from experiments.design.limits import check_methods
from experiments.load import find, load_gun, load_setup, load_study
from experiments.record.names import journals
from experiments.study.preregistration import FreezeStatus, carried_by, numbers_there

EXAMPLE_SEED = 1
"""Orders are shown for this seed if the config gives none; a run without a seed draws its own."""


@dataclass(frozen=True, slots=True, kw_only=True)
class StudyCheck:
    """What the config of a study means; `bounds`: in which units those of its equivalence tests are."""

    study: str
    participants: int
    eligibility: EligibilityConfig
    experiments: tuple[DesignCheck, ...]
    bounds: tuple[str, ...] = field(default=(), metadata=UNWRITTEN)
    frozen: FreezeStatus | None = field(default=None, metadata=AS_FROZEN)


@dataclass(frozen=True, slots=True, kw_only=True)
class GunCheck:
    """What the config of a gun holds."""

    gun: str
    methods: tuple[str, ...]
    assumed: tuple[str, ...]
    frozen: FreezeStatus | None = field(default=None, metadata=AS_FROZEN)


@dataclass(frozen=True, slots=True, kw_only=True)
class PaperCheck:
    """What a paper's file holds: the participants of its experiments."""

    paper: str
    experiments: dict[str, int]
    frozen: FreezeStatus | None = field(default=None, metadata=AS_FROZEN)


AnyCheck = DesignCheck | StudyCheck | GunCheck | PaperCheck


def check(name: str, seed: int | None, participants: int) -> AnyCheck:
    """What any config means, and how it stands beside its preregistration. `ConfigError` names what is wrong."""
    found, path = _meaning(name, seed, participants), find(name)
    carried = [*carried_by(journals(path.parent / "results"))] if isinstance(found, StudyCheck) else []
    if not carried and not numbers_there(path.parent):
        return found
    from experiments.study.folders import freeze_status  # noqa: PLC0415 - of use for what was frozen alone

    stand = freeze_status(path.parent, carried)
    return replace(found, frozen=stand if isinstance(found, StudyCheck) else stand.of_files(_files(found, path)))


def _files(found: AnyCheck, path: Path) -> list[str]:
    """The files that a config stands for, by their place beside the study."""
    gun = load_setup(path).config.gun if isinstance(found, DesignCheck) else path.name
    return [path.name, Path(os.path.normpath(gun)).as_posix()]


def _meaning(name: str, seed: int | None, participants: int) -> AnyCheck:
    path = find(name)
    table = read_toml(path)
    if "design" in table or "factors" in table:
        return _design(load_setup(name), seed, participant_codes(participants))
    if "experiments" in table:
        return _study(name, seed)
    if {"methods", "voice_coil"} & set(table):
        gun = load_gun(path)
        check_methods(gun, tuple(gun.methods), path)
        return GunCheck(gun=gun.title, methods=tuple(gun.methods), assumed=tuple(gun.assumed))
    if not {"direction", "preference", "paper"} & set(table):
        raise ConfigError(f"{path}: no config that is known: neither a design, a study, a gun nor a paper's numbers")
    from analysis.paper.paper import load_paper  # noqa: PLC0415 - no design has published numbers

    paper = load_paper(path)
    return PaperCheck(paper=path.name, experiments={"direction": paper.direction.n, "preference": paper.preference.n})


def _study(name: str, seed: int | None) -> StudyCheck:
    study, folder = load_study(name)
    if study.paper is not None:
        _check_paper(find(name), folder / study.paper)
    setups = [load_setup(folder / experiment) for experiment in study.experiments]
    own, bounds = study.preregistration, tuple[str, ...]()
    if any(one is not None for one in (own.rules, own.requests, own.codebook)):
        from analysis.summary.planned_files import bounds_told, planned_files  # noqa: PLC0415 - most studies name no such files

        designs = [setup.config for setup in setups]
        bounds = tuple(bounds_told(planned_files(find(name), study, designs).requests, designs))
    return StudyCheck(
        study=study.title,
        participants=study.participants,
        eligibility=study.eligibility,
        experiments=tuple(_design(setup, seed, study.codes()) for setup in setups),
        bounds=bounds,
    )


def _check_paper(study: Path, paper: Path) -> None:
    """`ConfigError`: the numbers that a study is to be compared with are not there, or are none."""
    if not paper.is_file():
        raise ConfigError(at_key(study, f"paper = {paper.name!r}: no such file beside the study; leave the key out"))
    from analysis.paper.paper import load_paper  # noqa: PLC0415 - as above

    load_paper(paper)


def _design(setup: Setup[DesignConfig], seed: int | None, codes: Sequence[str]) -> DesignCheck:
    chosen = next((one for one in (seed, setup.config.seed) if one is not None), EXAMPLE_SEED)
    return check_design(setup, chosen, codes)


def check_text(found: AnyCheck) -> str:
    """What was found, for a person."""
    if isinstance(found, GunCheck | PaperCheck):
        named = (one.name for one in fields(found) if one.name != "frozen")
        texts = ["\n".join(f"{name}: {plain(getattr(found, name))}" for name in named)]
    else:
        texts = [with_tables(one) if one.tables else in_text(one) for one in sections(found)]
    if found.frozen is not None:
        texts.append(in_text(Section(title="Preregistration", items=(*found.frozen.problems, *found.frozen.lines()))))
    return "\n\n".join(texts)


def sections(found: DesignCheck | StudyCheck) -> tuple[Section, ...]:
    """What a config means: sections for each design, that of the study before them."""
    if isinstance(found, DesignCheck):
        return design_sections(found)
    asked = found.eligibility.model_dump(mode="json", exclude_none=True)
    rules = "; ".join(f"{key} {_listed(value)}" for key, value in asked.items() if value)
    title = f"Study: {found.study}, {how_many(found.participants, 'participant')}; eligibility: {rules or 'everyone'}"
    return Section(title=title, items=found.bounds), *(
        section for one in found.experiments for section in sections(one)
    )


def _listed(value: object) -> str:
    return ", ".join(value) if isinstance(value, list) else str(value)
