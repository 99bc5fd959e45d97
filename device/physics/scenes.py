"""What each reduced model costs in accuracy, stated and tested, and the cheapest that a use can bear.

A scene names outputs and errors, `choose_model` picks a model and says what it stands for.

The errors are relative to `full` and hold for guns near the paper's: every number within 10 % of it, but friction, the
same on both ways, from 0.1 to 1.12 N, and any contact depth. They are the largest of 500,000 random guns and of all
corners of that box, and a fifth more; `inf` is no promise. The peak on the hand needs the inductance; impulse, height
and times need the back-EMF; the landing of a shorted coil needs everything.

Operations of a shot of the paper's gun, counted (coil open, coil shorted): `closed-form` 0.2 thousand, `no-inductance`
6 and 14, `ballistic` 16, `full` 16 and 42. Errors are stated near the paper's gun only; elsewhere the pick is `full`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from itertools import product
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from device.parameters import DriveOff, Emf, GunParameters
from device.physics.equations import model_number

OUTPUTS = (
    "peak_force_N",
    "recoil_end_s",
    "recoil_impulse_Ns",
    "firing_end_s",
    "max_displacement_m",
    "reset_end_s",
    "impact_speed_m_s",
)
NEAR = 0.10
"""How far a number may lie from the paper's, relative."""
FRICTION_N = (0.1, 1.12)

_EXACT = 1e-12  # of `full`, against fifty digits
_NONE = math.inf
_STATED: dict[tuple[str, str, str], tuple[float, ...]] = {
    ("no-inductance", "open", "printed"): (0.23, 0.031, 0.022, 0.019, 0.032, 0.014, 0.032),
    ("no-inductance", "open", "reciprocal"): (0.23, 0.043, 0.0085, 0.0051, 0.021, 0.0059, 0.019),
    ("no-inductance", "shorted", "printed"): (0.23, 0.031, 0.021, 0.021, 0.034, 0.062, 0.63),
    ("no-inductance", "shorted", "reciprocal"): (0.23, 0.14, 0.024, 0.0057, 0.0058, 0.33, _NONE),
    ("closed-form", "open", "printed"): (0.23, 0.31, 0.67, 0.36, 1.2, 0.30, 1.1),
    ("closed-form", "open", "reciprocal"): (0.23, 0.24, 0.34, 0.20, 0.56, 0.17, 0.54),
    ("closed-form", "shorted", "printed"): (0.23, 0.31, 0.67, 0.38, 1.2, _NONE, _NONE),
    ("closed-form", "shorted", "reciprocal"): (0.23, 0.24, 0.34, 0.20, 0.56, _NONE, _NONE),
    ("ballistic", "open", "printed"): (_EXACT, _EXACT, _EXACT, 0.089, _EXACT, 0.24, _EXACT),
    ("ballistic", "open", "reciprocal"): (_EXACT, _EXACT, _EXACT, 0.10, _EXACT, 0.23, _EXACT),
    ("ballistic", "shorted", "printed"): (_EXACT, _EXACT, _EXACT, 0.089, 0.11, _NONE, _NONE),
    ("ballistic", "shorted", "reciprocal"): (_EXACT, _EXACT, _EXACT, 0.10, 0.011, _NONE, _NONE),
}


def stated_error(fidelity: str, output: str, drive_off: DriveOff, emf: Emf) -> float:
    """The largest relative error of an output of a model near the paper's gun. `ValueError`: no such one.

    >>> stated_error("no-inductance", "peak_force_N", "shorted", "printed")
    0.23
    """
    model_number(fidelity)
    if output not in OUTPUTS:
        raise ValueError(f"output is {output!r}; errors are stated for {', '.join(OUTPUTS)}")
    if fidelity == "full":
        return _EXACT
    return _STATED[fidelity, drive_off, emf][OUTPUTS.index(output)]


COSTS = ("closed-form", "no-inductance", "ballistic", "full")
"""The models, the cheapest first, over both states of the coil: shorted, the two in the middle cost alike."""
TABLE_COSTS = ("closed-form", "full")
"""Those that pay in a table of shots: in compiled batches the two in the middle take longer than `full`."""
COLLISION = "collision_force_N"
NEEDED = (*OUTPUTS, COLLISION)
"""What a scene may need."""

_PAPER = GunParameters()
_WITHIN = tuple(
    one.name
    for one in fields(GunParameters)
    if isinstance(one.default, float) and one.name not in ("friction_N", "contact_depth_m")
)
_ROUNDING = 1e-12  # a number that is 10 % off in decimals is within 10 %

Contact = Literal["impulse", "compliant"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Scene:
    """A use of the model: each output it needs with the largest relative error it bears.

    `curves`: it needs the course over time, which only `full` has. `contact_error` is what it bears in the peak of
    the collision between a rigid stop's estimate and one that gives way; None if it asks for no collision.
    `ValueError` names an output that there is not, or an error that is not above 0.
    """

    name: str
    needs: Mapping[str, float]
    why: str = ""
    curves: bool = False
    contact_error: float | None = None

    def __post_init__(self) -> None:
        for output, error in self.needs.items():
            if output not in NEEDED:
                raise ValueError(f"output is {output!r}; a scene may need {', '.join(NEEDED)}")
            if not error > 0:
                raise ValueError(f"the error borne in {output} is {error}; it must be above 0")


SCENES = {
    scene.name: scene
    for scene in (
        Scene(name="session", needs={"reset_end_s": 0.005}, why="the next shot waits for the magnet: a millisecond"),
        Scene(
            name="figure",
            needs=dict.fromkeys(NEEDED, 1e-3),
            why="curves, to the width of a line",
            curves=True,
            contact_error=0.05,
        ),
        Scene(
            name="sweep",
            needs={"peak_force_N": 0.01, "recoil_impulse_Ns": 0.01, "recoil_end_s": 0.01},
            why="designs are ranked by the recoil that they render",
        ),
        Scene(
            name="percept",
            needs=dict.fromkeys(("recoil_impulse_Ns", "recoil_end_s", "firing_end_s", "impact_speed_m_s"), 0.05),
            why="below what a hand tells apart in force, about 7 % (Pang, Tan & Durlach 1991)",
            contact_error=0.05,
        ),
    )
}
"""What the product's own uses need; the errors borne are assumed."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ModelChoice:
    """The model picked for a scene, the largest error it stands for in each output that is needed, and why."""

    scene: str
    fidelity: str
    errors: Mapping[str, float] = field(default_factory=dict)
    reason: str = ""


def choose_model(
    scene: Scene, gun: GunParameters = _PAPER, costs: Sequence[str] = COSTS, **arrays: ArrayLike
) -> ModelChoice:
    """The cheapest model within what the scene bears, for a gun, or for guns whose numbers are in `arrays`.

    Cheapest is the first of `costs`, whose last is `full`.

    >>> choose_model(SCENES["sweep"]).fidelity, choose_model(SCENES["sweep"], GunParameters(voltage_V=5.0)).fidelity
    ('ballistic', 'full')
    """
    refused = [_far_from_paper(gun, arrays) or ("only full gives the course over time" if scene.curves else "")]
    for fidelity in () if refused[0] else costs[:-1]:
        errors = _errors(fidelity, scene, gun, arrays)
        beyond = next((output for output, error in errors.items() if error > scene.needs[output]), None)
        if beyond is None:
            return ModelChoice(scene=scene.name, fidelity=fidelity, errors=errors, reason=_reason(refused))
        refused.append(_refusal(fidelity, beyond, errors[beyond], scene.needs[beyond]))
    errors = _errors("full", scene, gun, arrays)
    return ModelChoice(scene=scene.name, fidelity="full", errors=errors, reason=_reason(refused))


def _reason(refused: list[str]) -> str:
    return "; ".join(filter(None, refused)) or "nothing is cheaper"


def _refusal(fidelity: str, output: str, error: float, borne: float) -> str:
    if math.isinf(error):
        return f"{fidelity} promises nothing of {output}"
    return f"{fidelity} may miss {output} by {error:.2g}, {borne:.2g} is borne"


def _errors(fidelity: str, scene: Scene, gun: GunParameters, arrays: Mapping[str, ArrayLike]) -> dict[str, float]:
    return {output: _stated(fidelity, output, gun, arrays) for output in scene.needs}


def _stated(fidelity: str, output: str, gun: GunParameters, arrays: Mapping[str, ArrayLike]) -> float:
    """The largest stated error over the options of the guns; m v^2/x_k has that of v twice."""
    offs, emfs = (np.unique(np.asarray(arrays.get(name, getattr(gun, name)))).tolist() for name in ("drive_off", "emf"))
    plain = "impact_speed_m_s" if output == COLLISION else output
    error = max(stated_error(fidelity, plain, off, emf) for off, emf in product(offs, emfs))
    return error * (2.0 + error) if output == COLLISION else error


def _far_from_paper(gun: GunParameters, arrays: Mapping[str, ArrayLike]) -> str:
    """What takes the guns out of the box in which errors are stated; empty if they are within."""
    if gun.return_friction_N not in (None, gun.friction_N) or "return_friction_N" in arrays:
        return "errors are stated for dampers that brake both ways alike"
    for name in (*_WITHIN, "friction_N"):
        value, (low, high) = np.asarray(arrays.get(name, getattr(gun, name))), _bounds(name)
        outside = value[~((value >= low * (1 - _ROUNDING)) & (value <= high * (1 + _ROUNDING)))]
        if outside.size:
            return f"{name} is {outside.flat[0]:g}; errors are stated from {low:g} to {high:g}"
    return ""


def _bounds(name: str) -> tuple[float, float]:
    if name == "friction_N":
        return FRICTION_N
    paper = getattr(_PAPER, name)
    return paper * (1 - NEAR), paper * (1 + NEAR)


def choose_contact(scene: Scene, gun: GunParameters, impact_speed_m_s: float) -> tuple[Contact, float]:
    """The collision's model and the error of the peak that it stands for.

    The impulse with equation (4)'s peak, if the scene bears what a stop that gives way (`compliant_collision`) may
    add: with the push p = k x_0 - F_f and r = p x_k/(m v^2) at most r + sqrt(1 + r^2) - 1 + k x_k^2/(2 m v^2).
    """
    twice_energy_J = gun.magnet_mass_kg * impact_speed_m_s**2
    if twice_energy_J == 0.0:
        return "impulse", 0.0
    push_N = abs(gun.stiffness_N_m * gun.preload_length_m - gun.homeward_friction_N)
    part = push_N * gun.contact_depth_m / twice_energy_J
    error = part + math.hypot(1.0, part) - 1.0 + gun.stiffness_N_m * gun.contact_depth_m**2 / (2.0 * twice_energy_J)
    bears = scene.contact_error is None or error <= scene.contact_error
    return ("impulse", error) if bears else ("compliant", 0.0)
