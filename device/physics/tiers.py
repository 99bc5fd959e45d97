"""What each reduced model costs in accuracy, stated and tested.

The errors are relative to `full` and hold for guns near the paper's: every number within 10 % of it, but friction, the
same on both ways, from 0.1 to 1.12 N, and any contact depth. They are the largest of 500,000 random guns and of all
corners of that box, and a fifth more; `inf` is no promise. The peak on the hand needs the inductance; impulse, height
and times need the back-EMF; the landing of a shorted coil needs everything.
"""

from __future__ import annotations

import math

from device.parameters import DriveOff, Emf
from device.physics.single import model_of

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
    model_of(fidelity)
    if output not in OUTPUTS:
        raise ValueError(f"output is {output!r}; errors are stated for {', '.join(OUTPUTS)}")
    if fidelity == "full":
        return _EXACT
    return _STATED[fidelity, drive_off, emf][OUTPUTS.index(output)]
