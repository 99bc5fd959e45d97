"""What each reduced model costs in accuracy, stated and tested.

The errors are relative to `full` and hold for guns near the paper's: every number but friction and pulse length
within 10 % of it, friction from 0.1 to 1.12 N. They are the largest of 200,000 random guns and a fifth more; `inf` is
no promise. The peak on the hand needs the inductance; impulse, height and times need the back-EMF; the landing of a
shorted coil needs everything.
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
    ("no-inductance", "open", "printed"): (0.22, 0.030, 0.020, 0.017, 0.030, 0.013, 0.025),
    ("no-inductance", "open", "reciprocal"): (0.22, 0.042, 0.0035, 0.0040, 0.010, 0.0020, 0.0080),
    ("no-inductance", "shorted", "printed"): (0.22, 0.030, 0.020, 0.017, 0.030, 0.040, 0.50),
    ("no-inductance", "shorted", "reciprocal"): (0.22, 0.11, 0.020, 0.0040, 0.0055, 0.17, _NONE),
    ("closed-form", "open", "printed"): (0.22, 0.29, 0.60, 0.32, 1.0, 0.27, 0.80),
    ("closed-form", "open", "reciprocal"): (0.22, 0.23, 0.31, 0.17, 0.51, 0.14, 0.42),
    ("closed-form", "shorted", "printed"): (0.22, 0.29, 0.60, 0.32, 1.0, _NONE, _NONE),
    ("closed-form", "shorted", "reciprocal"): (0.22, 0.23, 0.31, 0.17, 0.51, _NONE, _NONE),
    ("ballistic", "open", "printed"): (_EXACT, _EXACT, _EXACT, 0.085, _EXACT, 0.21, _EXACT),
    ("ballistic", "open", "reciprocal"): (_EXACT, _EXACT, _EXACT, 0.095, _EXACT, 0.22, _EXACT),
    ("ballistic", "shorted", "printed"): (_EXACT, _EXACT, _EXACT, 0.085, 0.022, _NONE, _NONE),
    ("ballistic", "shorted", "reciprocal"): (_EXACT, _EXACT, _EXACT, 0.095, _EXACT, _NONE, _NONE),
}


def stated_error(fidelity: str, output: str, drive_off: DriveOff, emf: Emf) -> float:
    """The largest relative error of an output of a model near the paper's gun. `ValueError`: no such one.

    >>> stated_error("no-inductance", "peak_force_N", "shorted", "printed")
    0.22
    """
    model_of(fidelity)
    if output not in OUTPUTS:
        raise ValueError(f"output is {output!r}; errors are stated for {', '.join(OUTPUTS)}")
    if fidelity == "full":
        return _EXACT
    return _STATED[fidelity, drive_off, emf][OUTPUTS.index(output)]
