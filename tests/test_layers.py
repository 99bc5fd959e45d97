"""The house has rooms, and imports go one way through them: whoever breaks that is told here."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
ROOMS = ("device", "experiments", "analysis")
READERS = ("experiments.record.columns", "experiments.record.journal", "experiments.study.register")
"""What the analysis may know of the experiments: the names of columns, and the readers of what runs leave."""
PURE = {
    "device": {
        *("words", "parameters", "limits", "methods", "physics", "vibration"),
        *("wire.errors", "wire.frame", "wire.records"),
        *("twin.budget", "twin.machine", "twin.core", "twin.scripts", "twin.faults", "twin.body"),
        *("serial_gun.address", "serial_gun.asked", "serial_gun.clocks", "serial_gun.outcomes"),
        *("serial_gun.checks", "serial_gun.reports"),
    },
    "experiments": {
        "beginnings",
        "canonical",
        "columns",
        "config",
        "gun",
        "orders",
        "plan",
        "setup",
        "steps",
        "streams",
        "study",
        "tables",
        "toml_text",
        "dates",
        "screens.console.people",
    },
}
HEAVY = {
    "psychopy": ("experiments.screens.participant", "experiments.doctor.programs"),
    "PyQt6": ("experiments.screens.console", "experiments.doctor.programs"),
    "matplotlib": "analysis.report.figures",
    "jinja2": "analysis.report.page",
    "serial": "device.serial_gun",
    "rich": "experiments.roof",
    "typer": "experiments.roof",
    "numba": ("device.physics.compiled", "analysis.predict.bench.peers"),
}


def modules() -> Iterator[tuple[str, ast.Module]]:
    for room in ROOMS:
        for path in sorted((ROOT / room).rglob("*.py")):
            name = ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")
            yield name, ast.parse(path.read_text(encoding="utf-8"))


MODULES = dict(modules())


def imports(tree: ast.Module) -> Iterator[str]:
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def allowed(importer: str, imported: str) -> bool:
    """The table of the design: who may import whom."""
    room = imported.split(".", maxsplit=1)[0]
    if room not in ROOMS or importer.startswith("experiments.roof"):
        return True
    if importer.startswith("device"):
        return room == "device"
    if importer.startswith("analysis"):
        return room == "analysis" or imported.startswith(READERS)
    return room in ("device", "experiments") and not imported.startswith("experiments.roof")


@pytest.mark.parametrize("name", MODULES)
def test_a_room_imports_only_what_the_design_allows(name: str) -> None:
    forbidden = [imported for imported in imports(MODULES[name]) if not allowed(name, imported)]
    assert not forbidden, f"{name} must not import {forbidden}"


@pytest.mark.parametrize(
    ("importer", "imported"),
    [
        ("device.words", "experiments.design.plan"),
        ("experiments.design.plan", "analysis.stats.anova"),
        ("experiments.session", "recoil.cli"),
        ("analysis.logs.reading", "experiments.design.plan"),
        ("analysis.logs.reading", "device.words"),
    ],
)
def test_a_forbidden_import_would_be_noticed(importer: str, imported: str) -> None:
    assert not allowed(importer, imported)


@pytest.mark.parametrize("package", HEAVY)
def test_a_heavy_package_enters_in_one_room(package: str) -> None:
    users = [name for name, tree in MODULES.items() if any(i.split(".")[0] == package for i in imports(tree))]
    assert users
    assert all(name.startswith(HEAVY[package]) for name in users), users


SESSIONS = [
    name for name in MODULES if name.endswith((".session", ".plan", ".rows", ".observer")) and "roof" not in name
]


@pytest.mark.parametrize("name", [f"{room}.{module}" for room in PURE for module in sorted(PURE[room])] + SESSIONS)
def test_a_pure_module_touches_neither_files_nor_clock_nor_terminal(name: str) -> None:
    touching = {"os", "sys", "time", "socket", "subprocess", "threading", "serial", "fcntl", "experiments.record.storage"}
    found = {i for i in imports(MODULES[name]) if i.split(".")[0] in touching or i.startswith("experiments.record.storage")}
    assert not found, f"{name} is pure and must not import {found}"


def functions() -> Iterator[tuple[str, int]]:
    for name, tree in MODULES.items():
        for node in ast.walk(tree):
            if isinstance(node, ast.FunctionDef):
                yield f"{name}.{node.name}", _length(node)


def _length(node: ast.FunctionDef) -> int:
    body = node.body[1:] if ast.get_docstring(node) else node.body
    return (body[-1].end_lineno or 0) - body[0].lineno + 1 if body else 0


def test_no_function_is_longer_than_forty_lines_and_no_module_than_four_hundred() -> None:
    long_functions = [f"{name}: {length}" for name, length in functions() if length > 40]
    long_modules = [name for name, tree in MODULES.items() if tree.body and (tree.body[-1].end_lineno or 0) > 400]
    assert not long_functions
    assert not long_modules
