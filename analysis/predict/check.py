"""`recoil check`: what a config means, without running anything: design, orders, duration, drive and limits."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, fields, replace
from typing import Any

from analysis.paper.paper import load_paper
from analysis.predict.check_design import DesignCheck, check_design, design_sections
from analysis.report.section import Section
from analysis.report.serial import OPTIONAL, plain
from analysis.report.terminal import in_text, with_tables
from device.limits import MAX_COIL_C, MAX_DUTY, MAX_SHOTS_PER_MINUTE
from device.parameters import GunParameters
from device.physics import simulate
from device.words import MAX_PULSE_S, MAX_VOLTAGE_V, Pulse
from experiments import catalogue
from experiments.config.door import EligibilityConfig, Model, participant_codes, read_toml
from experiments.config.setup import Setup
from experiments.design.config import DesignConfig
from experiments.design.plan import next_row
from experiments.direction.config import Design, DirectionConfig
from experiments.direction.synthetic import model_parameters
from experiments.load import MethodLimits, check_limits, check_methods, find, load_gun, load_setup, load_study
from experiments.screens.synthetic import synthetic_participant_of
from experiments.synthetic.model_based import NEUTRAL, rates_by_instruction
from experiments.synthetic.percept import percepts_of

EXAMPLE_SEED = 1
"""Orders are shown for this seed if the config gives none; a run without a seed draws its own."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MethodCheck:
    """How a method is driven: a pulse through a coil, or an effect of the library; what it has not is None."""

    method: str
    label: str
    damper: str | None
    settle_s: float
    voltage_V: float | None = field(default=None, metadata=OPTIONAL)
    pulse_s: float | None = field(default=None, metadata=OPTIONAL)
    effect: int | None = field(default=None, metadata=OPTIONAL)
    friction_N: float | None = field(default=None, metadata=OPTIONAL)
    peak_force_N: float | None = field(default=None, metadata=OPTIONAL)


@dataclass(frozen=True, slots=True, kw_only=True)
class DeviceLimits:
    """The limits that no config can lift."""

    voltage_V: float = MAX_VOLTAGE_V
    pulse_s: float = MAX_PULSE_S
    duty: float = MAX_DUTY
    shots_per_minute: float = MAX_SHOTS_PER_MINUTE
    coil_temperature_C: float = MAX_COIL_C


@dataclass(frozen=True, slots=True, kw_only=True)
class ExperimentCheck:
    """What the config of an experiment means for some participants.

    `instructions`: what is read out, by name. `orders`: each participant's methods. `felt_forward_rates`: of synthetic
    participants who feel the gun, by method and instruction; empty for others.
    """

    experiment: str
    title: str
    design: Model
    instructions: dict[str, str]
    trials: int
    duration_s: float
    break_s: float
    breaks: str
    stated_duration_s: float
    seed: int | None
    orders: dict[str, tuple[str, ...]]
    gun: str
    methods: tuple[MethodCheck, ...]
    felt_forward_rates: dict[str, dict[str, float]]
    limits: DeviceLimits
    assumed: tuple[str, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class StudyCheck:
    """What the config of a study means."""

    study: str
    participants: int
    eligibility: EligibilityConfig
    experiments: tuple[ExperimentCheck | DesignCheck, ...]


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


AnyCheck = ExperimentCheck | DesignCheck | StudyCheck | GunCheck | PaperCheck


def check(name: str, seed: int | None, participants: int) -> AnyCheck:
    """What any config means. `ConfigError` names what is wrong with it."""
    path = find(name)
    table = read_toml(path)
    if "experiment" in table or "factors" in table:
        return _experiment(load_setup(name), seed, participant_codes(participants))
    if "experiments" in table:
        return _study(name, seed)
    if "methods" in table and "voice_coil" in table:
        gun = load_gun(path)
        check_methods(gun, tuple(gun.methods), path)
        return GunCheck(gun=gun.title, methods=tuple(gun.methods), assumed=tuple(gun.assumed))
    paper = load_paper(path)
    return PaperCheck(paper=path.name, experiments={"direction": paper.direction.n, "preference": paper.preference.n})


def _study(name: str, seed: int | None) -> StudyCheck:
    study, folder = load_study(name)
    setups = [load_setup(str(folder / experiment)) for experiment in study.experiments]
    return StudyCheck(
        study=study.title,
        participants=study.participants,
        eligibility=study.eligibility,
        experiments=tuple(_experiment(setup, seed, study.codes()) for setup in setups),
    )


def _experiment(setup: Setup[Any], seed: int | None, codes: Sequence[str]) -> ExperimentCheck | DesignCheck:
    config = setup.config
    chosen = next((s for s in (seed, config.seed) if s is not None), None)
    if isinstance(config, DesignConfig):
        return check_design(setup, EXAMPLE_SEED if chosen is None else chosen, codes)
    limits = check_limits(setup)
    return ExperimentCheck(
        experiment=config.experiment,
        title=config.title,
        design=config.design,
        instructions=_instructions(config),
        trials=config.design.trials,
        duration_s=config.duration_s,
        break_s=config.break_s,
        breaks=_breaks(config),
        stated_duration_s=config.timing.planned_s,
        seed=chosen,
        orders=_orders(setup, EXAMPLE_SEED if chosen is None else chosen, codes),
        gun=setup.gun.title,
        methods=tuple(_method(setup, limit) for limit in limits),
        felt_forward_rates=_felt(setup),
        limits=DeviceLimits(),
        assumed=(*config.assumed, *(f"{config.gun}: {key}" for key in setup.gun.assumed)),
    )


def _breaks(config: Any) -> str:
    if not isinstance(config, DirectionConfig):
        return "none"
    sessions, sets = len(config.methods), config.design.sets_per_session
    between = config.breaks
    return f"{sessions * (sets - 1)} x {between.between_sets_s:g} s + {sessions - 1} x {between.between_sessions_s:g} s"


def _instructions(config: Any) -> dict[str, str]:
    """What is read out before the sets, by instruction."""
    if not isinstance(config, DirectionConfig):
        return {}
    return {name: config.instruction_text(name) for name in config.design.instructions}


def _felt(setup: Setup[Any]) -> dict[str, dict[str, float]]:
    """The forward rates that participants who feel the gun will have, by method and instruction. Empty for others.

    `ConfigError`: numbers that make nobody.
    """
    config = setup.config
    if config.synthetic.observer != "felt":
        return {}
    row = next_row(config.design.order, len(config.methods), [])
    synthetic_participant_of(setup, catalogue.experiment(setup).make_plan(config, "P01", EXAMPLE_SEED, row))
    if not isinstance(config, DirectionConfig):
        return {}
    mind = model_parameters(config)
    percepts = percepts_of(setup.gun.renderings(config.methods), mind.percept.leak_s)
    told = config.design.instructions or (NEUTRAL,)
    return {
        method: {name: rate for name, rate in rates_by_instruction(mind, percept).items() if name in told}
        for method, percept in percepts.items()
    }


def _orders(setup: Setup[Any], seed: int, codes: Sequence[str]) -> dict[str, tuple[str, ...]]:
    """Each participant's order of methods, as runs in this order would get it."""
    config, used, found = setup.config, list[int](), dict[str, tuple[str, ...]]()
    for code in codes:
        row = next_row(config.design.order, len(config.methods), used)
        used += [] if row is None else [row]
        found[code] = tuple(catalogue.experiment(setup).make_plan(config, code, seed, row).methods)
    return found


def _method(setup: Setup[Any], limit: MethodLimits) -> MethodCheck:
    method, parameters = setup.gun.methods[limit.method], setup.gun.rendering(limit.method)
    found = MethodCheck(method=limit.method, label=method.label, damper=method.damper, settle_s=limit.settle_s)
    if isinstance(limit.drive, Pulse):
        found = replace(found, voltage_V=limit.drive.voltage_V, pulse_s=limit.drive.pulse_s)
    else:
        found = replace(found, effect=limit.drive.effect)
    if isinstance(parameters, GunParameters):
        found = replace(found, friction_N=parameters.friction_N, peak_force_N=simulate(parameters).peak_force_N)
    return found


def check_text(found: AnyCheck) -> str:
    """What was found, for a person."""
    if isinstance(found, GunCheck | PaperCheck):
        return "\n".join(f"{one.name}: {plain(getattr(found, one.name))}" for one in fields(found))
    return "\n\n".join(with_tables(one) if one.tables else in_text(one) for one in sections(found))


def sections(found: ExperimentCheck | DesignCheck | StudyCheck) -> tuple[Section, ...]:
    """What a config means: a section for each experiment, that of the study before them."""
    if isinstance(found, DesignCheck):
        return design_sections(found)
    if isinstance(found, ExperimentCheck):
        return (_experiment_section(found),)
    asked = found.eligibility.model_dump(mode="json", exclude_none=True)
    rules = ", ".join(f"{key} {value}" for key, value in asked.items() if value)
    title = f"Study: {found.study}, {found.participants} participants; eligibility: {rules or 'everyone'}"
    return Section(title=title), *(section for one in found.experiments for section in sections(one))


def _experiment_section(found: ExperimentCheck) -> Section:
    parts = (_design_lines, _instruction_lines, _order_lines, _drive_lines, _felt_lines, _assumed_lines)
    return Section(
        title=f"{found.title} ({found.experiment})", items=tuple(line for lines in parts for line in lines(found))
    )


def _design_lines(found: ExperimentCheck) -> list[str]:
    minutes, stated = found.duration_s / 60, found.stated_duration_s / 60
    design = found.design.model_dump(mode="json", exclude={"methods", "instructions"})
    return [
        f"Design    {found.trials} trials; {', '.join(f'{key} {value}' for key, value in design.items())}",
        f"Duration  {minutes:.1f} min planned ({stated:g} min stated), of which breaks {found.break_s:g} s "
        f"({found.breaks})",
    ]


def _instruction_lines(found: ExperimentCheck) -> list[str]:
    if not isinstance(found.design, Design) or not found.instructions:
        return []
    sets = found.design.sets_per_session
    head = f"one a set, each in {sets // len(found.instructions)} of a session's {sets} sets, in random order"
    return [f"Told      {head}", *(f"  {name:14} “{text}”" for name, text in found.instructions.items())]


def _order_lines(found: ExperimentCheck) -> list[str]:
    origin = f"seed {found.seed}" if found.seed is not None else f"seed {EXAMPLE_SEED}, as an example: see --seed"
    return [
        f"Orders    ({origin})",
        *(f"  {code:10} {' > '.join(methods)}" for code, methods in found.orders.items()),
    ]


def _drive_lines(found: ExperimentCheck) -> list[str]:
    limits = found.limits
    return [
        f"Gun       {found.gun}",
        *(f"  {method.method:14} {_drive(method)}" for method in found.methods),
        f"Limits    {limits.voltage_V:g} V, pulse {1000 * limits.pulse_s:g} ms, "
        f"duty {100 * limits.duty:g} % over any second, "
        f"{limits.shots_per_minute:g} shots a minute, coil {limits.coil_temperature_C:g} °C; "
        "no config can lift them",
    ]


def _drive(method: MethodCheck) -> str:
    damper = f", damper {method.damper}" if method.damper else ""
    if method.voltage_V is None or method.pulse_s is None:
        return f"library effect {method.effect}, {1000 * method.settle_s:.0f} ms"
    return (
        f"{method.voltage_V:g} V for {1000 * method.pulse_s:g} ms, friction {method.friction_N:g} N{damper}: "
        f"peak force {method.peak_force_N:.1f} N on the hand, home after {1000 * method.settle_s:.0f} ms "
        "(by the model)"
    )


def _felt_lines(found: ExperimentCheck) -> list[str]:
    if not found.felt_forward_rates:
        return []
    lines = [
        f"  {method:14} {', '.join(f'{100 * rate:.1f} % ({name})' for name, rate in rates.items())}"
        for method, rates in found.felt_forward_rates.items()
    ]
    return ["Felt      right answers to forward shots, of synthetic participants (by the model)", *lines]


def _assumed_lines(found: ExperimentCheck) -> list[str]:
    return ["Assumed   (not in the paper)", *(f"  {key}" for key in found.assumed)]
