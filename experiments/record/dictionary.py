"""The data dictionary, printed from the columns: `python -m experiments.record.dictionary`."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator
from pathlib import Path

from experiments.design.config import DesignConfig
from experiments.record.design_columns import columns
from experiments.record.shots_table import SHOTS
from experiments.record.tables import FILE_SUFFIX, TABLES, Column

_PAGE = Path(__file__).with_name("dictionary.md")
"""All that does not follow from the columns, which take the place of `{tables}`."""


def dictionary() -> str:
    """The data dictionary as Markdown."""
    names = {f"sub-<ID>_task-{experiment}_{FILE_SUFFIX[experiment]}.csv": TABLES[experiment] for experiment in TABLES}
    names[_SHOTS_NAME] = SHOTS
    tables = "\n".join(line for name, columns in names.items() for line in _table(name, columns))
    return _PAGE.read_text(encoding="utf-8").replace("{tables}", tables)


def design_dictionary(design: DesignConfig) -> str:
    """The columns of a design's table as Markdown, to lie beside its logs."""
    head = f"# {design.title}\n\nOne row a planned trial, also those not reached. Empty means missing; 0 is a value.\n"
    return "\n".join([head, *_table(f"sub-<ID>_task-{design.design}_{design.table}.csv", columns(design))])


def shots_dictionary() -> str:
    """The columns of what a sensor measured as Markdown, to lie beside its tables."""
    head = "# What a sensor measured\n\nOne row a shot that was fired. Empty means missing; 0 is a value.\n"
    return "\n".join([head, *_table(_SHOTS_NAME, SHOTS)])


_SHOTS_NAME = "sub-<ID>_task-<experiment>_shots.csv"


def _table(name: str, columns: Iterable[Column]) -> Iterator[str]:
    yield f"## `{name}`\n"
    yield "| column | type | values | meaning |"
    yield "| --- | --- | --- | --- |"
    for column in columns:
        yield f"| `{column.name}` | {column.type} | {_values(column)} | {column.description} |"
    yield ""


def _values(column: Column) -> str:
    levels = ", ".join(f"`{level}`" for level in column.levels)
    return levels + (" or empty" if levels and not column.required else "")


if __name__ == "__main__":
    sys.stdout.write(dictionary())
