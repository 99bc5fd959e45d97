"""Plug-ins as a package manager leaves them: a module and its entry points in a folder on the path."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
ACCELEROMETER = ROOT / "docs" / "examples" / "serial_accelerometer" / "serial_accelerometer.py"
SOUND_CARD = (ROOT / "docs" / "examples" / "sound_card_gun" / "sound_card_gun.py").read_text(encoding="utf-8")


def install(
    patch: pytest.MonkeyPatch, folder: Path, source: str, *, name: str, module: str, package: str = "", make: str = ""
) -> None:
    """A package that brings a gun by this name; it is gone with the patch."""
    install_point(
        patch,
        folder,
        source,
        f"[recoil.guns]\n{name} = {module}:{make or 'open_gun'}\n",
        module=module,
        package=package,
    )


def install_sensor(patch: pytest.MonkeyPatch, folder: Path, source: str, *, name: str, module: str) -> None:
    """A package that brings a sensor by this name; it is gone with the patch."""
    install_point(patch, folder, source, f"[recoil.sensors]\n{name} = {module}:open_sensor\n", module=module)


def install_point(
    patch: pytest.MonkeyPatch, folder: Path, source: str, point: str, *, module: str, package: str = ""
) -> None:
    """A package with an entry point."""
    package = package or module
    (folder / f"{module}.py").write_text(source, encoding="utf-8")
    info = folder / f"{package}-0.1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {package}\nVersion: 0.1.0\n")
    (info / "entry_points.txt").write_text(point)
    patch.syspath_prepend(str(folder))
    patch.delitem(sys.modules, module, raising=False)


def install_sound_card(patch: pytest.MonkeyPatch, folder: Path) -> None:
    """The worked example of the docs."""
    install(patch, folder, SOUND_CARD, name="sound-card", module="sound_card_gun")
