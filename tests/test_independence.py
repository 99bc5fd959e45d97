"""Tests stand alone: no test module imports another, and none reaches into what is private to the product."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

TESTS = Path(__file__).parent
MODULES = sorted(TESTS.rglob("*.py"))
LET_THROUGH = {"_replace", "_repr_html_", "_shutdown", "_run_exitfuncs", "_exit"}
"""Private by their names only: those of named tuples, notebooks and the interpreter."""


def imported(tree: ast.Module) -> set[str]:
    """The modules that are imported, and the names from them as if they were modules."""
    names = set[str]()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            names |= {node.module} | {f"{node.module}.{alias.name}" for alias in node.names}
    return names


def private_names(tree: ast.Module) -> set[str]:
    """Private attributes of anything but the object itself, and private names that are imported from the product."""
    attributes = {
        f"{ast.unparse(node.value)}.{node.attr}"
        for node in ast.walk(tree)
        if isinstance(node, ast.Attribute)
        and is_private(node.attr)
        and not (isinstance(node.value, ast.Name) and node.value.id in ("self", "cls"))
    }
    return attributes | {name for name in imported(tree) if is_private(name.rpartition(".")[2])}


def is_private(name: str) -> bool:
    return name.startswith("_") and not name.endswith("__") and name not in LET_THROUGH


@pytest.mark.slow
@pytest.mark.parametrize("path", MODULES, ids=lambda path: path.stem)
def test_no_test_module_is_imported_and_nothing_private_reached_into(path: Path) -> None:
    tree = ast.parse(path.read_text(encoding="utf-8"))
    assert {name for name in imported(tree) if name.startswith("tests.test_")} == set()
    assert private_names(tree) == set()


def test_every_way_in_is_seen() -> None:
    ways = "from device.gun import _one\nimport device._two\ngun._three\nrun().gun._four = 1"
    assert private_names(ast.parse(ways)) == {"device.gun._one", "device._two", "gun._three", "run().gun._four"}
