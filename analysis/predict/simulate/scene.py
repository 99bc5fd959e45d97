"""`recoil simulate --scene` and `--need`: the model that a use can bear, and what was picked."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

from analysis.predict.simulate.sweep import axis_of
from device.parameters import GunParameters
from device.physics.scenes import COLLISION, NEEDED, SCENES, Scene, choose_contact, choose_model
from experiments.config.door import ConfigError

_OWN = "needs of your own"


@dataclass(frozen=True, slots=True, kw_only=True)
class ModelRequest:
    """Which model is wanted: by its name, by a scene's, or by needs, OUTPUT=ERROR each."""

    fidelity: str | None
    scene: str | None
    needs: Sequence[str]


def picked(asked: ModelRequest, gun: GunParameters, vary: Sequence[str]) -> tuple[str, dict[str, Any]]:
    """The model's name and, for a scene, what to tell of the pick. `ConfigError`: more than one is asked for.

    `vary` are the parameters of a table: the pick holds for all of its guns.
    """
    scene = _scene(asked)
    if scene is None:
        return asked.fidelity or "full", {}
    axes = [axis_of(words, gun) for words in vary]
    choice = choose_model(scene, gun, **{axis.key: axis.values for axis in axes})
    return choice.fidelity, {"scene": {"needs": dict(scene.needs), "why": scene.why} | asdict(choice)}


def contact_of(asked: ModelRequest, gun: GunParameters, impact_speed_m_s: float | None) -> dict[str, Any]:
    """How the collision may be taken, where the scene asks for one and there is one."""
    scene = _scene(asked)
    if scene is None or impact_speed_m_s is None or scene.contact_error is None:
        return {}
    contact, error = choose_contact(scene, gun, impact_speed_m_s)
    return {"contact_model": contact, "contact_error": error}


def with_scene(told: dict[str, Any], text: str) -> str:
    """The text after the pick for a person, if there was one."""
    return f"{_as_text(told['scene'])}\n{text}" if told else text


def _as_text(scene: dict[str, Any]) -> str:
    errors = ", ".join(f"{output} {error:.2g}" for output, error in scene["errors"].items())
    lines = [f"Scene {scene['scene']}: model {scene['fidelity']}, stated errors {errors}", f"  {scene['reason']}"]
    if scene["fidelity"] != "full":
        others = ", ".join(output for output in NEEDED if output not in scene["errors"])
        lines += [f"  not needed, so not promised: {others}"] if others else []
    if "contact_model" in scene:
        lines.append(f"  collision: {_CONTACTS[scene['contact_model']].format(scene['contact_error'])}")
    return "\n".join(lines)


_CONTACTS = {
    "impulse": "impulse m v; its peak m v^2/x_k is within {:.2g} of that of a stop that gives way",
    "compliant": "take a stop that gives way (--contact-stiffness): spring and friction add more than is borne",
}


def _scene(asked: ModelRequest) -> Scene | None:
    given = [
        name
        for name, value in (("--fidelity", asked.fidelity), ("--scene", asked.scene), ("--need", asked.needs))
        if value
    ]
    if len(given) > 1:
        raise ConfigError(f"{' and '.join(given)}: each of them says which model; give one")
    if asked.needs:
        return _own_scene(asked.needs)
    if asked.scene is not None and asked.scene not in SCENES:
        raise ConfigError(f"--scene {asked.scene}: must be one of {', '.join(SCENES)}")
    return None if asked.scene is None else SCENES[asked.scene]


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
