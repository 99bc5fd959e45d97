"""The reference pages that follow from the code, to `docs/reference/generated`: `python -m docs.generate`."""

from __future__ import annotations

import inspect
import json
import re
import sys
import tomllib
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import MISSING, fields
from enum import Enum
from pathlib import Path
from typing import Any

import typer
from typer.core import TyperGroup

from device.parameters import GunParameters, VibrationParameters
from docs import statistics_schema
from experiments.record.dictionary import dictionary
from recoil.cli import app
from recoil.schemas import schemas

HERE = Path(__file__).parent / "reference"
OUT = HERE / "generated"
CONFIGS = Path(__file__).parent.parent / "configs"
UNITS = {"s": "s", "N": "N", "V": "V", "kg": "kg", "m": "m", "ohm": "Ω", "H": "H", "Hz": "Hz", "years": "years"}
COMPOUND = {"V_s_m": "V·s/m", "N_A": "N/A", "N_m": "N/m", "m_s2": "m/s²"}
SHIPPED = {
    "design": "direction.toml",
    "gun": "gun.toml",
    "study": "study.toml",
    "synthetic": "synthetic/direction.toml",
}
"""The shipped file whose values are shown beside the defaults."""
EXAMPLES_OF = {
    "columns": "examples/columns.toml",
    "levels": "examples/levels.toml",
    "rules": "examples/rules.toml",
    "requests": "examples/requests.toml",
}
KINDS = {
    "design": "a study's design",
    "gun": "a gun and its rendering methods",
    "study": "a study: its people and experiments",
    "synthetic": "simulated participants",
    "paper": "published numbers",
    "columns": "a map of another program's columns",
    "levels": "a map of another program's answers at levels",
    "rules": "exclusions",
    "requests": "further tests and models",
    "codebook": "codes of free descriptions",
}


def pages() -> dict[str, str]:
    """The pages by file name."""
    made = {f"config-{kind}.md": _config_page(kind, json.loads(text)) for kind, text in _schemas().items()}
    made["commands.md"] = _commands_page()
    made["columns.md"] = dictionary()
    made["statistics.md"] = statistics_schema.page()
    made["statistics.schema.json"] = statistics_schema.text()
    return made


def _schemas() -> dict[str, bytes]:
    found = {name.removesuffix(".json"): text for name, text in schemas().items()}
    return {kind: found[kind] for kind in KINDS}


def table(header: tuple[str, ...], rows: Iterator[tuple[str, ...]] | list[tuple[str, ...]]) -> str:
    """A table in Markdown."""
    lines = (header, tuple("---" for _ in header), *rows)
    return "".join("| " + " | ".join(cell.replace("|", "\\|") for cell in line) + " |\n" for line in lines)


# configs


def _config_page(kind: str, schema: dict[str, Any]) -> str:
    meanings = tomllib.loads((HERE / "keys.toml").read_text(encoding="utf-8"))
    shipped = SHIPPED.get(kind) or EXAMPLES_OF.get(kind)
    parts = {kind: schema} | schema.get("$defs", {})
    once = Counter(key for part in parts.values() for key in part.get("properties", {}))
    found = _comments(CONFIGS / shipped) if shipped else {}
    notes = {key: note for key, note in found.items() if once[key] == 1}
    head = f"# {kind}.toml: {KINDS[kind]}\n\n"
    if shipped:
        head += f"“In the shipped file” is `configs/{shipped}`, with the comment that stands there.\n\n"
    places = {kind: "Top of the file"}
    for name, place in dict.fromkeys(_places(schema, schema.get("$defs", {}), "")):
        places[name] = f"{places[name]}, {place}" if name in places else place
    return head + "\n".join(_part(name, part, places, meanings, notes) for name, part in parts.items()) + _numbers(kind)


def _places(part: dict[str, Any], parts: Mapping[str, Any], under: str) -> Iterator[tuple[str, str]]:
    """Where each table stands in the file, as its head is written there."""
    for key, schema in part.get("properties", {}).items():
        for name, place in _heads(schema, f"{under}{key}"):
            law = next((one["const"] for one in parts[name]["properties"].values() if "const" in one), None)
            shown = f"[{place}]" if not place.endswith("[]") else f"[[{place[:-2]}]]"
            yield name, f"`{shown}`" + (f" of `{law}`" if law else "")
            yield from _places(parts[name], parts, f"{place.removesuffix('[]')}.")


def _heads(schema: dict[str, Any], place: str) -> Iterator[tuple[str, str]]:
    """The tables that a key's value may be, with their places; `[]` ends that of a list."""
    if "$ref" in schema:
        yield schema["$ref"].rpartition("/")[2], place
    for one in (*schema.get("anyOf", ()), *schema.get("oneOf", ())):
        yield from _heads(one, place)
    for inner in _values(schema):
        yield from _heads(inner, f"{place}.NAME")
    if "items" in schema:
        yield from _heads(schema["items"], f"{place}[]")


def _part(
    name: str, part: dict[str, Any], places: Mapping[str, str], meanings: Mapping[str, Any], notes: Mapping[str, str]
) -> str:
    keys, said = part.get("properties", {}), meanings.get(name, {})
    if set(keys) != set(said):
        wrong = ", ".join(sorted(set(keys) ^ set(said)))
        raise SystemExit(f"docs/reference/keys.toml: [{name}]: {wrong}: a key without a meaning, or no such key")
    title = places[name]
    about = "" if "`" not in title else inspect.cleandoc(part.get("description", "")).replace("\n", " ") + "\n\n"
    required = set(part.get("required", ()))
    rows = [
        (
            f"`{key}`",
            _type(key_schema, places),
            _unit(key),
            _default(key_schema, key in required),
            said[key],
            notes.get(key, ""),
        )
        for key, key_schema in keys.items()
    ]
    return f"## {title}\n\n{about}" + table(("key", "type", "unit", "default", "meaning", "in the shipped file"), rows)


def _type(schema: dict[str, Any], places: Mapping[str, str]) -> str:
    if "anyOf" in schema:
        return " or ".join(dict.fromkeys(_type(one, places) for one in schema["anyOf"] if one.get("type") != "null"))
    if "oneOf" in schema:
        return "one of: " + ", ".join(_type(one, places) for one in schema["oneOf"])
    if "$ref" in schema:
        return f"table {places[schema['$ref'].rpartition('/')[2]]}"
    if "enum" in schema or "const" in schema:
        return ", ".join(f"`{one}`" for one in schema.get("enum", [schema.get("const")]))
    if schema.get("type") == "array":
        return f"list of {_type(schema['items'], places)}" if "items" in schema else "list"
    if schema.get("type") == "object":
        inner = _values(schema)
        return f"table of {_type(inner[0], places)}" if inner else "table"
    return _bounded(schema)


def _values(schema: dict[str, Any]) -> list[dict[str, Any]]:
    """What the values of a table with free names may be."""
    found = [schema.get("additionalProperties"), *schema.get("patternProperties", {}).values()]
    return [one for one in found if isinstance(one, dict) and one]


def _bounded(schema: dict[str, Any]) -> str:
    name = {"string": "text", "integer": "whole number", "boolean": "`true` or `false`"}.get(
        schema.get("type", ""), "number"
    )
    signs = {"exclusiveMinimum": "above", "minimum": "from", "exclusiveMaximum": "below", "maximum": "to"}
    bounds = [f"{word} {schema[key]:g}" for key, word in signs.items() if key in schema and abs(schema[key]) < 2**62]
    return " ".join([name, *bounds])


def _unit(key: str) -> str:
    for end, unit in COMPOUND.items():
        if key.endswith(f"_{end}"):
            return unit
    return UNITS.get(key.rpartition("_")[2], "years" if "_years_" in key else "") if "_" in key else ""


def _default(schema: dict[str, Any], required: bool) -> str:
    if required:
        return "*required*"
    value = schema.get("default")
    return "" if value in (None, [], {}, "") or isinstance(value, dict) else f"`{json.dumps(value)}`"


def _comments(path: Path) -> dict[str, str]:
    """The value and comment of each key on one line of a shipped file, but of those that have several values there."""
    found: dict[str, set[str]] = {}
    for line in path.read_text(encoding="utf-8").splitlines():
        if read := re.match(r"#? ?([A-Za-z_]+) = ([^#\n]*[^#\s\[])\s*(?:#\s*(.*))?$", line):
            key, value, comment = read.groups()
            shown = value if len(value) < 40 else value[:37] + "..."
            found.setdefault(key, set()).add(f"`{shown}`" + (f" — {comment}" if comment else ""))
    return {key: only for key, (only, *others) in found.items() if not others}


def _numbers(kind: str) -> str:
    """The gun's own parameters with their sources."""
    if kind != "gun":
        return ""
    return "\n" + "\n".join(
        f"## `[{name}]`\n\n" + table(("key", "unit", "default", "symbol, source"), _parameters(numbers))
        for name, numbers in {"voice_coil": GunParameters, "vibration": VibrationParameters}.items()
    )


def _parameters(numbers: type) -> Iterator[tuple[str, ...]]:
    source = inspect.getsource(numbers)
    for one in fields(numbers):
        comment = re.search(rf"^    {one.name}: .*?#\s*(.*)$", source, re.MULTILINE)
        default = "" if one.default is MISSING or one.default is None else f"`{one.default}`"
        yield f"`{one.name}`", _unit(one.name), default, comment[1] if comment else ""


# commands


def _commands_page() -> str:
    """Every command by group, with an example that is run, and what `--help` says."""
    groups = tomllib.loads((HERE / "commands.toml").read_text(encoding="utf-8"))
    commands = dict(_commands(typer.main.get_command(app), "recoil"))
    named = [name for group in groups["groups"] for name in group["commands"]]
    if sorted(named) != sorted(commands):
        wrong = ", ".join(sorted(set(named) ^ set(commands)))
        raise SystemExit(f"docs/reference/commands.toml: {wrong}: not there, or no such command")
    head = f"# The command line\n\n{groups['about']}\n{groups['first']}"
    return head + "".join(_group(group, commands) for group in groups["groups"])


def _group(group: Mapping[str, Any], commands: Mapping[str, Any]) -> str:
    return f"\n## {group['name']}\n\n" + "\n".join(
        f"### {name}\n\n{commands[name].help}\n\n{example}\n{_options(commands[name])}"
        for name, example in group["commands"].items()
    )


def _commands(command: Any, name: str) -> Iterator[tuple[str, Any]]:
    if isinstance(command, TyperGroup):
        for inner, one in command.commands.items():
            yield from _commands(one, f"{name} {inner}")
    else:
        yield name, command


def _options(command: Any) -> str:
    rows = [
        (
            _names(one),
            one.help or "",
            "" if one.default in (None, False, "", ()) or one.required else f"`{_shown(one.default)}`",
        )
        for one in command.params
        if one.name != "help"
    ]
    return table(("option", "meaning", "default"), rows)


def _names(one: Any) -> str:
    if one.param_type_name == "argument":
        return f"`{(one.metavar or one.name.upper()).strip('{}')}`"
    metavar = "" if one.is_flag else one.metavar or _kind(one.type_descriptor.annotation)
    return f"`{' '.join([one.opts[0], metavar]).strip()}`"


def _kind(annotation: Any) -> str:
    """What an option takes, in a word."""
    if isinstance(annotation, type) and issubclass(annotation, Enum):
        return "|".join(one.value for one in annotation)
    return {int: "N", float: "X", Path: "PATH"}.get(annotation, "TEXT")


def _shown(value: object) -> str:
    return str(getattr(value, "value", value))


if __name__ == "__main__":
    OUT.mkdir(exist_ok=True)
    for name, content in pages().items():
        (OUT / name).write_text(content, encoding="utf-8")
    sys.exit(0)
