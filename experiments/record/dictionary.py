"""The data dictionary, printed from the columns: `python -m experiments.record.dictionary`."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

from experiments.record.tables import FILE_SUFFIX, TABLES, Column

_PAGE = Path(__file__).with_name("dictionary.md")
"""All that does not follow from the columns, which take the place of `{tables}`."""


def dictionary() -> str:
    """The data dictionary as Markdown."""
    tables = "\n".join(line for experiment in TABLES for line in _table(experiment))
    return _PAGE.read_text(encoding="utf-8").replace("{tables}", tables)


def _table(experiment: str) -> Iterator[str]:
    yield f"## `sub-<ID>_task-{experiment}_{FILE_SUFFIX[experiment]}.csv`\n"
    yield "| column | type | values | meaning |"
    yield "| --- | --- | --- | --- |"
    for column in TABLES[experiment]:
        yield f"| `{column.name}` | {column.type} | {_values(column)} | {column.description} |"
    yield ""


def _values(column: Column) -> str:
    levels = ", ".join(f"`{level}`" for level in column.levels)
    return levels + (" or empty" if levels and not column.required else "")


if __name__ == "__main__":
    sys.stdout.write(dictionary())
