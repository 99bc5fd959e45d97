"""What holds of the tests themselves: none of them asserts how fast the machine is; `make soak` measures that."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

FOLDER = Path(__file__).parent
FILES = sorted(path for path in FOLDER.glob("*.py") if not path.name.startswith("test_soak_"))
CLOCKS = {
    f"{name}{unit}"
    for name in ("monotonic", "perf_counter", "process_time", "thread_time", "time")
    for unit in ("", "_ns")
}
PLAIN = {"abs", "float", "int", "len", "max", "min", "round", "sorted", "sum"}
"""Calls out of which a clock's reading comes as what it was."""
ORDERS = {
    "test_clock.test_the_real_clock_is_the_machines",
    "test_console_participant.test_a_participants_key_is_a_response_time_from_the_onset_of_the_shot",
    "test_firmware_emulated.test_its_clock_goes_as_the_worlds",
    "test_serial_troubles.test_disarming_a_gun_that_is_gone_waits_for_its_watchdog",
    "test_participant_screen.test_a_key_tells_the_direction_and_when_it_went_down",
}
"""Where readings are compared for their order alone: what lies between two others does so on any machine."""


def clock_assertions(source: str, module: str = "") -> list[int]:
    """The lines of the asserts that compare a reading of the module `time`'s clocks, or what plainly comes from one.

    A reading is followed through names, sums and the like within a function; not through objects, attributes, other
    functions, nor clocks by other names.
    """
    found = list[int]()
    for node in ast.parse(source).body:
        if f"{module}.{getattr(node, 'name', '')}" not in ORDERS:
            names = read_names(node)
            asserts = (one for one in ast.walk(node) if isinstance(one, ast.Assert))
            found += [one.lineno for one in asserts if any(is_reading(side, names) for side in compared(one))]
    return found


def compared(node: ast.Assert) -> Iterator[ast.expr]:
    """Both sides of each comparison in an assert."""
    for one in ast.walk(node.test):
        if isinstance(one, ast.Compare):
            yield from (one.left, *one.comparators)


def read_names(node: ast.stmt) -> set[str]:
    """The names that hold a clock's reading somewhere below."""
    names, before = set[str](), None
    while names != before:
        before = set(names)
        for targets, value in given(node):
            if is_reading(value, names):
                names |= {one.id for target in targets for one in ast.walk(target) if isinstance(one, ast.Name)}
    return names


def given(node: ast.stmt) -> Iterator[tuple[list[ast.expr], ast.expr]]:
    """What is given a value below, and the value; a list, what is appended to it."""
    for one in ast.walk(node):
        match one:
            case ast.Assign(targets=targets, value=value):
                yield targets, value
            case ast.AnnAssign(target=target, value=ast.expr() as value) | ast.NamedExpr(target=target, value=value):
                yield [target], value
            case ast.AugAssign(target=target, value=value):
                yield [target], value
            case ast.Call(func=ast.Attribute(value=ast.Name() as target, attr="append"), args=[value]):
                yield [target], value


def is_reading(node: ast.AST, names: set[str]) -> bool:
    """Whether an expression is a clock's reading or plainly comes from one."""
    match node:
        case ast.Call(func=ast.Attribute(value=ast.Name(id="time"), attr=name)) | ast.Call(func=ast.Name(id=name)):
            return name in CLOCKS or (name in PLAIN and any(is_reading(one, names) for one in node.args))
        case ast.Name(id=name):
            return name in names
        case ast.Call() | ast.Lambda() | ast.Attribute():
            return False
        case _:
            return any(is_reading(one, names) for one in ast.iter_child_nodes(node))


@pytest.mark.slow
@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_no_assertion_compares_with_a_clock(path: Path) -> None:
    found = clock_assertions(path.read_text(encoding="utf-8"), path.stem)
    assert not found, (
        f"{', '.join(f'{path}:{line}' for line in found)}: wait for an event, and leave times to make soak"
    )


@pytest.mark.parametrize(
    "lines",
    [
        ("assert time.perf_counter() - start < 2",),
        ("end = time.monotonic() + 5", "assert time.time() < end"),
        ("start = time.monotonic()", "taken = abs(time.monotonic() - start)", "assert 0 < 1000 * taken < 50"),
        ("start = process_time_ns()", "assert min(3, process_time_ns() - start) < 2"),
        ("times = []", "times.append(time.perf_counter())", "assert max(times) < 2"),
        ("first, last = time.time(), 3", "assert first == 3, 'late'"),
    ],
)
def test_an_assertion_of_speed_would_be_noticed(lines: tuple[str, ...]) -> None:
    source = "\n    ".join(["import time", "def test_it():", *lines]).replace("time\n    def", "time\ndef")
    assert clock_assertions(source) == [len(lines) + 2]


@pytest.mark.parametrize(
    "lines",
    [
        ("start = time.monotonic()", "assert ask(start) == 3"),
        ("while time.monotonic() < end: pass", "assert done"),
        ("clock = lambda: time.monotonic()", "assert clock is not None"),
    ],
)
def test_what_is_no_assertion_of_speed_passes(lines: tuple[str, ...]) -> None:
    assert clock_assertions("\n    ".join(["def test_it():", *lines])) == []
