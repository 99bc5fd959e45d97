"""Short functions and modules: whoever writes a long one is told here."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
ROOMS = ("device", "experiments", "analysis", "recoil")


def modules() -> Iterator[tuple[str, ast.Module]]:
    for room in ROOMS:
        for path in sorted((ROOT / room).rglob("*.py")):
            name = ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")
            yield name, ast.parse(path.read_text(encoding="utf-8"))


def functions(tree: ast.Module) -> Iterator[ast.FunctionDef]:
    yield from (node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef))


def length(node: ast.FunctionDef) -> int:
    """From the first line of the body to the last, without the docstring."""
    body = node.body[1:] if ast.get_docstring(node) else node.body
    return (body[-1].end_lineno or 0) - body[0].lineno + 1 if body else 0


@pytest.mark.slow
def test_no_function_is_longer_than_45_lines_and_no_module_than_455() -> None:
    trees = dict(modules())
    assert [f"{name}.{one.name}" for name, tree in trees.items() for one in functions(tree) if length(one) > 45] == []
    assert [name for name, tree in trees.items() if tree.body and (tree.body[-1].end_lineno or 0) > 455] == []


def test_a_long_function_would_be_noticed() -> None:
    (one,) = functions(ast.parse("def name():\n    'doc'\n    a = 1\n    b = 2\n"))
    assert length(one) == 2
