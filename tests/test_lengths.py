"""Short functions and modules: whoever writes a long one is told here."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parent.parent
ROOMS = ("device", "experiments", "analysis", "recoil")


def modules() -> Iterator[tuple[str, ast.Module]]:
    for room in ROOMS:
        for path in sorted((ROOT / room).rglob("*.py")):
            name = ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")
            yield name, ast.parse(path.read_text(encoding="utf-8"))


MODULES = dict(modules())


def functions() -> Iterator[tuple[str, int]]:
    for name, tree in MODULES.items():
        for node in ast.walk(tree):
            if isinstance(node, ast.FunctionDef):
                yield f"{name}.{node.name}", _length(node)


def _length(node: ast.FunctionDef) -> int:
    body = node.body[1:] if ast.get_docstring(node) else node.body
    return (body[-1].end_lineno or 0) - body[0].lineno + 1 if body else 0


def test_no_function_is_longer_than_45_lines_and_no_module_than_455() -> None:
    long_functions = [f"{name}: {length}" for name, length in functions() if length > 45]
    long_modules = [name for name, tree in MODULES.items() if tree.body and (tree.body[-1].end_lineno or 0) > 455]
    assert not long_functions
    assert not long_modules
