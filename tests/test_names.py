"""One word for one thing: a public name stands in one module of the house. The exceptions are a table, with reasons."""

from __future__ import annotations

import ast
from collections import defaultdict
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from fnmatch import fnmatch
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
HOUSE = ("device", "experiments", "analysis", "recoil")


@dataclass(frozen=True, slots=True, kw_only=True)
class Shared:
    """Names that modules share: those that a pattern of `among` means, and so many others."""

    names: str
    among: tuple[str, ...]
    others: int = 0

    def covers(self, name: str, where: Iterable[str]) -> bool:
        others = [one for one in where if not any(fnmatch(one, pattern) for pattern in self.among)]
        return name in self.names.split() and len(others) <= self.others


EXCEPTIONS = {
    "a command, or a function for notebooks, has the name of what it calls": Shared(
        names=(
            "analyze audit bench check design freeze grim percept power read_logs rebuild reproduce run simulate study "
            "times verify"
        ),
        among=("recoil/commands/*", "recoil/api.py"),
        others=1,
    ),
    "each feature's own sections and summary, asked for by its module": Shared(
        names="in_short sections", among=("analysis/*",)
    ),
    "each program of the doctor is asked in the same way": Shared(
        names="look", among=("experiments/doctor/programs/*",)
    ),
    "where a program or a group of commands begins": Shared(
        names="app main", among=("recoil/cli.py", "recoil/commands/*", "*/__main__.py")
    ),
}
"""The names that may stand in several modules, by the reason."""


def modules() -> Iterator[Path]:
    """The modules of the house; a package's own file defines nothing that its modules do not."""
    for room in HOUSE:
        yield from (path for path in sorted((ROOT / room).rglob("*.py")) if path.name != "__init__.py")


def public_names(statements: Iterable[ast.stmt]) -> set[str]:
    """The public classes, functions, constants and type aliases that a module's statements define."""
    names = set[str]()
    for statement in statements:
        match statement:
            case ast.ClassDef() | ast.FunctionDef() | ast.AsyncFunctionDef():
                names.add(statement.name)
            case ast.Assign():
                names |= {name for target in statement.targets for name in set_names(target)}
            case ast.AnnAssign():
                names |= set_names(statement.target)
            case ast.If():
                names |= public_names([*statement.body, *statement.orelse])
            case ast.Try():
                names |= public_names([*statement.body, *statement.orelse, *statement.finalbody])
                names |= public_names(one for handler in statement.handlers for one in handler.body)
    return {name for name in names if not name.startswith("_")}


def set_names(target: ast.expr) -> set[str]:
    return {one.id for one in ast.walk(target) if isinstance(one, ast.Name) and isinstance(one.ctx, ast.Store)}


def doubled(names_by_module: Iterable[tuple[str, set[str]]]) -> dict[str, list[str]]:
    """The names that stand in more than one module, with those modules."""
    places = defaultdict[str, list[str]](list)
    for module, names in names_by_module:
        for name in names:
            places[name].append(module)
    return {name: where for name, where in sorted(places.items()) if len(where) > 1}


@pytest.fixture(scope="module")
def found() -> dict[str, list[str]]:
    """The doubled names of the house."""
    return doubled(
        (str(path.relative_to(ROOT)), public_names(ast.parse(path.read_text(encoding="utf-8")).body))
        for path in modules()
    )


@pytest.mark.slow
def test_a_public_name_stands_in_one_module_or_has_a_reason(found: dict[str, list[str]]) -> None:
    unexcused = {
        name: where
        for name, where in found.items()
        if not any(shared.covers(name, where) for shared in EXCEPTIONS.values())
    }
    assert unexcused == {}


@pytest.mark.slow
@pytest.mark.parametrize("reason", EXCEPTIONS)
def test_every_exception_is_still_one(found: dict[str, list[str]], reason: str) -> None:
    assert set(EXCEPTIONS[reason].names.split()) - found.keys() == set()


@pytest.mark.parametrize(
    "source",
    [
        "def name(): ...",
        "async def name(): ...",
        "class name: ...",
        "name = 1",
        "other, (name, *more) = 1, (2, 3)",
        "name: int = 1",
        "if True:\n    pass\nelse:\n    name = 1",
        "try:\n    pass\nexcept ValueError:\n    name = 1",
    ],
)
def test_every_way_of_defining_a_name_is_seen(source: str) -> None:
    assert "name" in public_names(ast.parse(source).body)
    assert doubled([("one.py", {"name"}), ("two.py", public_names(ast.parse(source).body))]) == {
        "name": ["one.py", "two.py"]
    }


@pytest.mark.parametrize("source", ["_name = 1", "from a import name", "def other(name): name = 1", "print(name)"])
def test_what_defines_no_public_name_is_not_seen(source: str) -> None:
    assert "name" not in public_names(ast.parse(source).body)
    assert "_name" not in public_names(ast.parse(source).body)


def test_an_exception_excuses_its_own_modules_alone() -> None:
    shared = Shared(names="check run", among=("recoil/commands/*",), others=1)
    assert shared.covers("check", ["experiments/check.py", "recoil/commands/sessions.py"])
    assert not shared.covers("check", ["experiments/check.py", "analysis/rules.py", "recoil/commands/sessions.py"])
    assert not shared.covers("checks", ["experiments/check.py", "recoil/commands/sessions.py"])


SPREAD_OUT = ("experiments/config/door.py", "experiments/config/findings.py", "analysis/report/serial.py")
"""The door, where tables come in and are refused, and the serialiser, where results go out."""


def loose(source: str) -> list[str]:
    """The functions whose signature has a dict of anything; `to_dict` gives one to a notebook and does it by name."""
    functions = [node for node in ast.walk(ast.parse(source)) if isinstance(node, ast.FunctionDef)]
    return [
        node.name
        for node in functions
        if node.name != "to_dict" and any("dict[str, Any]" in ast.unparse(one) for one in annotations(node))
    ]


def annotations(node: ast.FunctionDef) -> Iterator[ast.expr]:
    given = [*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs, node.args.vararg, node.args.kwarg]
    yield from (one.annotation for one in given if one is not None and one.annotation is not None)
    if node.returns is not None:
        yield node.returns


@pytest.mark.slow
def test_results_have_types_between_the_door_and_the_serialiser() -> None:
    found = {
        name: functions
        for path in modules()
        if (name := str(path.relative_to(ROOT))) not in SPREAD_OUT
        and "dict[str, Any]" in (source := path.read_text(encoding="utf-8"))
        and (functions := loose(source))
    }
    assert found == {}


@pytest.mark.parametrize(
    "signature",
    ["(a: dict[str, Any]): ...", "() -> list[dict[str, Any]]: ...", "(*, a: Callable[[dict[str, Any]], None]): ..."],
)
def test_a_signature_with_a_dict_of_anything_is_seen(signature: str) -> None:
    assert loose(f"def name{signature}") == ["name"]
    assert loose(f"class Room:\n    def name{signature}") == ["name"]
