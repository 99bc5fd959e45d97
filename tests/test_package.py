"""What the package says of itself is said alike wherever it is said."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parent.parent


@pytest.fixture(scope="module")
def project() -> dict[str, Any]:
    found: dict[str, Any] = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    return found


@pytest.fixture(scope="module")
def citation() -> str:
    return (ROOT / "CITATION.cff").read_text(encoding="utf-8")


def test_the_citation_has_the_packages_version_licence_authors_and_keywords(
    project: dict[str, Any], citation: str
) -> None:
    for key in ("version", "license"):
        assert f"\n{key}: {project[key]}\n" in citation
    assert re.findall("- name: (.*)", citation) == [author["name"] for author in project["authors"]]
    assert re.findall("  - (.*)", citation.split("keywords:")[1]) == project["keywords"]


def test_the_newest_version_of_the_changelog_is_the_packages(project: dict[str, Any]) -> None:
    newest = re.search(r"^## ([0-9.]+)", (ROOT / "CHANGELOG.md").read_text(encoding="utf-8"), re.MULTILINE)
    assert newest is not None
    assert newest[1] == project["version"]


def test_only_the_participants_screen_bounds_python_from_above(project: dict[str, Any]) -> None:
    assert project["requires-python"] == ">=3.11"
    bounded = [line for line in project["optional-dependencies"]["gui"] if "python_version <" in line]
    assert [line.split(">")[0] for line in bounded] == ["psychopy"]
    assert not any("python_version" in line for line in project["dependencies"])


@pytest.mark.parametrize("command", ["quick", "test", "checkers", "soak", "lint", "lock", "full", "reproduce"])
def test_each_make_command_of_contributing_is_one(command: str) -> None:
    assert f"make {command}" in (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    assert re.search(f"^{command}:", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE)
