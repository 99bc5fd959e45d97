"""The wheel, installed elsewhere, works from any folder: packages, configs, templates and all."""

from __future__ import annotations

import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parent.parent


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("wheel")
    subprocess.run(
        [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", folder],
        cwd=ROOT,
        check=True,
        capture_output=True,
    )
    return next(folder.glob("*.whl"))


def test_the_wheel_holds_the_four_packages_and_the_configs_and_nothing_else(wheel: Path) -> None:
    names = zipfile.ZipFile(wheel).namelist()
    assert {name.split("/")[0] for name in names if ".dist-info" not in name} == {
        "analysis",
        "device",
        "experiments",
        "recoil",
    }
    for name in (
        "experiments/shipped_configs/direction.toml",
        "experiments/shipped_configs/synthetic/direction-felt.toml",
        "experiments/shipped_configs/schemas/design.json",
        "analysis/report/templates/report.html.j2",
        "experiments/screens/console/console.qss",
        "experiments/catalogues/recoil.pot",
        "experiments/catalogues/zh/LC_MESSAGES/recoil.po",
        "experiments/catalogues/zh/LC_MESSAGES/recoil.po",
    ):
        assert name in names
    assert any(name.endswith(".dist-info/licenses/LICENSE") for name in names)
    assert not [name for name in names if "test" in Path(name).name]


def test_installed_elsewhere_recoil_works_from_any_folder(wheel: Path, tmp_path: Path) -> None:
    """Unpacked as an installer would, without the checkout in sight; the dependencies are this environment's."""
    site = tmp_path / "site"
    zipfile.ZipFile(wheel).extractall(site)
    program = f"import sys; sys.path.insert(0, {str(site)!r}); from recoil.cli import main; main()"
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()

    def recoil(*words: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [sys.executable, "-c", program, *words], cwd=elsewhere, capture_output=True, text=True, check=True
        )

    assert str(site) in recoil("configs").stdout
    recoil("run", "preference", "--participant", "P01", "--screen", "synthetic", "--language", "zh", "--unchecked")
    recoil("analyze", "results", "--out", "analysis")
    assert (elsewhere / "analysis" / "report.html").exists()
