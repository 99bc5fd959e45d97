"""`recoil check`: what a config means, without running anything: design, orders, duration, drive and limits."""

from __future__ import annotations

from typing import Any

from analysis.paper.paper import load_paper
from device.limits import MAX_COIL_C, MAX_DUTY, MAX_SHOTS_PER_MINUTE
from device.parameters import GunParameters
from device.physics import simulate
from device.words import MAX_PULSE_S, MAX_VOLTAGE_V, Pulse
from experiments import catalogue
from experiments.config.door import read_toml
from experiments.config.models import participant_codes
from experiments.config.setup import Setup
from experiments.design.plan import next_row
from experiments.direction.config import DirectionConfig
from experiments.direction.synthetic import model_parameters
from experiments.limits import MethodLimits, check_limits, check_methods
from experiments.load import find, load_gun, load_setup, load_study
from experiments.screens.synthetic import synthetic_participant_of
from experiments.synthetic.model_based import NEUTRAL, rates_by_instruction
from experiments.synthetic.percept import percepts_of

EXAMPLE_SEED = 1
"""Orders are shown for this seed if the config gives none; a run without a seed draws its own."""

Facts = dict[str, Any]


def check(name: str, seed: int | None, participants: int) -> Facts:
    """The facts of any config, as plain JSON values. `ConfigError` names what is wrong with it."""
    path = find(name)
    table = read_toml(path)
    if "experiment" in table:
        return setup_facts(load_setup(name), seed, participant_codes(participants))
    if "experiments" in table:
        return _study_facts(name, seed)
    if "methods" in table and "voice_coil" in table:
        gun = load_gun(path)
        check_methods(gun, tuple(gun.methods), path)
        return {"gun": gun.title, "methods": list(gun.methods), "assumed": list(gun.assumed)}
    paper = load_paper(path)
    return {"paper": path.name, "experiments": {"direction": paper.direction.n, "preference": paper.preference.n}}


def _study_facts(name: str, seed: int | None) -> Facts:
    study, folder = load_study(name)
    setups = [load_setup(str(folder / experiment)) for experiment in study.experiments]
    facts = [setup_facts(setup, seed, study.codes()) for setup in setups]
    return {
        "study": study.title,
        "participants": study.participants,
        "eligibility": study.eligibility.model_dump(mode="json", exclude_none=True),
        "experiments": facts,
    }


def setup_facts(setup: Setup[Any], seed: int | None, codes: list[str]) -> Facts:
    """What a setup means for these participants."""
    config = setup.config
    limits = check_limits(setup)
    chosen = next((s for s in (seed, config.seed) if s is not None), None)
    return {
        "experiment": config.experiment,
        "title": config.title,
        "design": config.design.model_dump(mode="json"),
        "instructions": _instructions(config),
        "trials": config.design.trials,
        "duration_s": config.duration_s,
        "break_s": config.break_s,
        "breaks": _breaks(config),
        "stated_duration_s": config.timing.planned_s,
        "seed": chosen,
        "orders": orders(setup, EXAMPLE_SEED if chosen is None else chosen, codes),
        "gun": setup.gun.title,
        "methods": [_method_facts(setup, limit) for limit in limits],
        "felt_forward_rates": _felt(setup),
        "limits": device_limits(),
        "assumed": [*config.assumed, *(f"{config.gun}: {key}" for key in setup.gun.assumed)],
    }


def _breaks(config: Any) -> str:
    if not isinstance(config, DirectionConfig):
        return "none"
    sessions, sets = len(config.design.methods), config.design.sets_per_session
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
    row = next_row(config.design.order, len(config.design.methods), [])
    synthetic_participant_of(setup, catalogue.experiment(setup).make_plan(config, "P01", EXAMPLE_SEED, row))
    if not isinstance(config, DirectionConfig):
        return {}
    mind = model_parameters(config)
    percepts = percepts_of(setup.gun.renderings(config.design.methods), mind.percept.leak_s)
    told = config.design.instructions or (NEUTRAL,)
    return {
        method: {name: rate for name, rate in rates_by_instruction(mind, percept).items() if name in told}
        for method, percept in percepts.items()
    }


def orders(setup: Setup[Any], seed: int, codes: list[str]) -> dict[str, list[str]]:
    """Each participant's order of methods, as runs in this order would get it."""
    config, used, found = setup.config, list[int](), {}
    for code in codes:
        row = next_row(config.design.order, len(config.design.methods), used)
        used += [] if row is None else [row]
        found[code] = list(catalogue.experiment(setup).make_plan(config, code, seed, row).methods)
    return found


def _method_facts(setup: Setup[Any], limit: MethodLimits) -> Facts:
    parameters = setup.gun.rendering(limit.method)
    facts: Facts = {
        "method": limit.method,
        "label": setup.gun.methods[limit.method].label,
        "damper": setup.gun.methods[limit.method].damper,
        "settle_s": limit.settle_s,
    }
    if isinstance(limit.drive, Pulse):
        facts |= {"voltage_V": limit.drive.voltage_V, "pulse_s": limit.drive.pulse_s}
    else:
        facts |= {"effect": limit.drive.effect}
    if isinstance(parameters, GunParameters):
        facts |= {"friction_N": parameters.friction_N, "peak_force_N": simulate(parameters).peak_force_N}
    return facts


def device_limits() -> Facts:
    """The limits that no config can lift."""
    return {
        "voltage_V": MAX_VOLTAGE_V,
        "pulse_s": MAX_PULSE_S,
        "duty": MAX_DUTY,
        "shots_per_minute": MAX_SHOTS_PER_MINUTE,
        "coil_temperature_C": MAX_COIL_C,
    }


def as_text(facts: Facts) -> str:
    """The facts for a person."""
    if "study" in facts:
        parts = [as_text(part) for part in facts["experiments"]]
        rules = ", ".join(f"{key} {value}" for key, value in facts["eligibility"].items() if value)
        head = f"Study: {facts['study']}, {facts['participants']} participants; eligibility: {rules or 'everyone'}"
        return "\n\n".join([head, *parts])
    if "experiment" not in facts:
        return "\n".join(f"{key}: {value}" for key, value in facts.items())
    chapters = (_design_lines, _instruction_lines, _order_lines, _drive_lines, _felt_lines, _assumed_lines)
    return "\n".join(line for chapter in chapters for line in chapter(facts))


def _design_lines(facts: Facts) -> list[str]:
    minutes, stated = facts["duration_s"] / 60, facts["stated_duration_s"] / 60
    apart = ("methods", "instructions")
    design = ", ".join(f"{key} {value}" for key, value in facts["design"].items() if key not in apart)
    return [
        f"{facts['title']} ({facts['experiment']})",
        f"  Design    {facts['trials']} trials; {design}",
        f"  Duration  {minutes:.1f} min planned ({stated:g} min stated), of which breaks {facts['break_s']:g} s "
        f"({facts['breaks']})",
    ]


def _instruction_lines(facts: Facts) -> list[str]:
    told = facts["instructions"]
    if not told:
        return []
    sets = facts["design"]["sets_per_session"]
    head = f"one a set, each in {sets // len(told)} of a session's {sets} sets, in random order"
    return [f"  Told      {head}", *(f"    {name:14} “{text}”" for name, text in told.items())]


def _order_lines(facts: Facts) -> list[str]:
    origin = f"seed {facts['seed']}" if facts["seed"] is not None else f"seed {EXAMPLE_SEED}, as an example: see --seed"
    return [
        f"  Orders    ({origin})",
        *(f"    {code:10} {' > '.join(methods)}" for code, methods in facts["orders"].items()),
    ]


def _drive_lines(facts: Facts) -> list[str]:
    limits = facts["limits"]
    return [
        f"  Gun       {facts['gun']}",
        *(f"    {method['method']:14} {_drive(method)}" for method in facts["methods"]),
        f"  Limits    {limits['voltage_V']:g} V, pulse {1000 * limits['pulse_s']:g} ms, "
        f"duty {100 * limits['duty']:g} % over any second, "
        f"{limits['shots_per_minute']:g} shots a minute, coil {limits['coil_temperature_C']:g} °C; "
        "no config can lift them",
    ]


def _drive(method: Facts) -> str:
    damper = f", damper {method['damper']}" if method["damper"] else ""
    if "effect" in method:
        return f"library effect {method['effect']}, {1000 * method['settle_s']:.0f} ms"
    return (
        f"{method['voltage_V']:g} V for {1000 * method['pulse_s']:g} ms, friction {method['friction_N']:g} N{damper}: "
        f"peak force {method['peak_force_N']:.1f} N on the hand, home after {1000 * method['settle_s']:.0f} ms "
        "(by the model)"
    )


def _felt_lines(facts: Facts) -> list[str]:
    rates = facts["felt_forward_rates"]
    if not rates:
        return []
    lines = [
        f"    {method:14} {', '.join(f'{100 * rate:.1f} % ({name})' for name, rate in found.items())}"
        for method, found in rates.items()
    ]
    return ["  Felt      right answers to forward shots, of synthetic participants (by the model)", *lines]


def _assumed_lines(facts: Facts) -> list[str]:
    return ["  Assumed   (not in the paper)", *(f"    {key}" for key in facts["assumed"])]
