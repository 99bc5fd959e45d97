"""`recoil simulate --scene` and `--need`: the model that a use can bear, and what was picked."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace

from numpy.typing import ArrayLike

from analysis.predict.simulate.request import ModelRequest
from analysis.report.section import Section
from analysis.report.serial import OPTIONAL
from device.parameters import GunParameters
from device.physics.scenes import (
    COLLISION,
    COSTS,
    NEEDED,
    SCENES,
    TABLE_COSTS,
    ModelChoice,
    Scene,
    choose_contact,
    choose_model,
)
from experiments.config.door import ConfigError

_OWN = "needs of your own"


@dataclass(frozen=True, slots=True, kw_only=True)
class ScenePick(ModelChoice):
    """The model picked for a scene, what the scene needs, and how its collision may be taken if it asks for one."""

    needs: Mapping[str, float]
    why: str
    contact_model: str | None = field(default=None, metadata=OPTIONAL)
    contact_error: float | None = field(default=None, metadata=OPTIONAL)


def picked(request: ModelRequest, gun: GunParameters, varied: Mapping[str, ArrayLike]) -> tuple[str, ScenePick | None]:
    """The model's name and, for a scene, the pick. `ConfigError`: more than one is asked for.

    `varied` are the parameters of a table: the pick holds for all of its guns.
    """
    scene = _scene(request)
    if scene is None:
        return request.fidelity or "full", None
    choice = choose_model(scene, gun, TABLE_COSTS if varied else COSTS, **varied)
    return choice.fidelity, ScenePick(**asdict(choice), needs=dict(scene.needs), why=scene.why)


def with_contact(
    pick: ScenePick, request: ModelRequest, gun: GunParameters, impact_speed_m_s: float | None
) -> ScenePick:
    """The pick with how the collision may be taken, where the scene asks for one and there is one."""
    scene = _scene(request)
    if scene is None or impact_speed_m_s is None or scene.contact_error is None:
        return pick
    contact, error = choose_contact(scene, gun, impact_speed_m_s)
    return replace(pick, contact_model=contact, contact_error=error)


def scene_section(pick: ScenePick) -> Section:
    """The pick in words."""
    errors = ", ".join(f"{output} {error:.2g}" for output, error in pick.errors.items())
    lines = [pick.reason]
    if pick.fidelity != "full":
        others = ", ".join(output for output in NEEDED if output not in pick.errors)
        lines += [f"not needed, so not promised: {others}"] if others else []
    if pick.contact_model is not None:
        lines.append(f"collision: {_CONTACTS[pick.contact_model].format(pick.contact_error)}")
    return Section(title=f"Scene {pick.scene}: model {pick.fidelity}, stated errors {errors}", items=tuple(lines))


_CONTACTS = {
    "impulse": "impulse m v; its peak m v^2/x_k is within {:.2g} of that of a stop that gives way",
    "compliant": "take a stop that gives way (--contact-stiffness): spring and friction add more than is borne",
}


def _scene(request: ModelRequest) -> Scene | None:
    given = [
        name
        for name, value in (("--fidelity", request.fidelity), ("--scene", request.scene), ("--need", request.needs))
        if value
    ]
    if len(given) > 1:
        raise ConfigError(f"{' and '.join(given)}: each of them says which model; give one")
    if request.needs:
        return _own_scene(request.needs)
    if request.scene is not None and request.scene not in SCENES:
        raise ConfigError(f"--scene {request.scene}: must be one of {', '.join(SCENES)}")
    return None if request.scene is None else SCENES[request.scene]


def _own_scene(needs: Sequence[str]) -> Scene:
    errors = dict(_need(words) for words in needs)
    return Scene(name=_OWN, needs=errors, contact_error=errors.get(COLLISION))


def _need(words: str) -> tuple[str, float]:
    output, _, text = words.partition("=")
    try:
        error = float(text)
    except ValueError:
        error = math.nan
    if output not in NEEDED or not 0 < error < math.inf:
        raise ConfigError(
            f"--need {words}: must be OUTPUT=ERROR, a relative error above 0, with an output of {', '.join(NEEDED)}"
        )
    return output, error
