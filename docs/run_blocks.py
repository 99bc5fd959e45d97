"""Every block of code in the pages and the README is run: `python -m docs.run_blocks`, or with the pages to run.

The blocks of a page are carried out in order, from an empty folder.
The word behind the language of a fence says what is done with the block:

- `bash` is carried out by bash, where `recoil` is this one; it goes on in the folder that the block before left.
- `python` is carried out in one namespace a page.
- `toml`, `csv` with `file=NAME` are written to that file (`more=NAME` adds to its end, `set=NAME`
  changes the lines of these keys in their tables, as a reader does in an editor); TOML without a name is parsed.
- `text output` is compared with what the block before printed; `...` stands for anything.
- `text message` must stand in the program's own code, but for `...`.
- `exit=N` or `exit=N,M` is the exit code that the block may end with, 0 unless given.
- `hardware` marks what needs a gun, a display or a person, `make` what `.ci/run` carries out itself: neither is run,
  but every command in them, and every command in the text, must be one that there is, with the options that it has.
"""

from __future__ import annotations

import contextlib
import doctest
import io
import json
import multiprocessing
import os
import re
import shlex
import subprocess
import sys
import tempfile
import time
import tomllib
import traceback
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

import typer
from jsonschema import Draft202012Validator
from typer.core import TyperGroup

from docs import statistics_schema
from recoil.cli import app
from tests import warm_start

ROOT = Path(__file__).parent.parent
BUILT = ("_build",)
RULES = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE
INLINE = re.compile(r"`(recoil [^`]+|make [a-z]+)`")
PLACEHOLDER = re.compile(r"^\W*$")


class BlockError(Exception):
    """A block that does not do what its page says, with page and line."""


@dataclass(frozen=True)
class Block:
    """A fenced block of a page; `line` is that of its first line of code."""

    page: Path
    line: int
    language: str
    words: tuple[str, ...]
    text: str

    def error(self, what: str) -> BlockError:
        """That it went wrong here."""
        return BlockError(f"{self.page}:{self.line}: {what}")


@dataclass
class Reader:
    """Somebody who follows a page: where they are, what they have defined, what was printed last."""

    folder: Path
    names: dict[str, object] = field(default_factory=dict)
    printed: str = ""

    def follow(self, block: Block) -> None:
        """Do what a block says; `BlockError` if it does not come out."""
        marks = {word.partition("=")[0]: word.partition("=")[2] for word in block.words}
        for mark, do in MARKS.items():
            if mark in marks:
                do(self, block, marks[mark])
                return
        if block.language not in LANGUAGES:
            raise block.error(f"nothing runs a block of {block.language!r}; mark it, or teach docs/run_blocks.py")
        LANGUAGES[block.language](self, block, marks.get("exit", "0"))

    def check_words(self, block: Block, _: str) -> None:
        """The commands of a block that is not run must be ones that there are."""
        for command in re.sub(r"\\\n", " ", block.text).splitlines():
            if why := refused(command.split(" #")[0]):
                raise block.error(why)

    def look_up(self, block: Block, _: str) -> None:
        """A message must be one that the program has."""
        for part in block.text.split("..."):
            if _plain(part) not in _spoken():
                raise block.error(f"nothing in the program says {part.strip()!r}")

    def parse(self, block: Block, _: str) -> None:
        """TOML must be TOML."""
        _parse(block, block.text)

    def pass_by(self, block: Block, _: str) -> None:
        """What is only looked at."""

    def carry_out(self, block: Block, code: str) -> None:
        """Have bash do it, as far as its exit code."""
        here = self.folder.parent / "here"
        script = f"set -euo pipefail\ntrap 'pwd > {shlex.quote(str(here))}' EXIT\n{block.text}"
        done = subprocess.run(
            ["bash", "-c", script],
            cwd=self.folder,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            check=False,
        )
        self.folder, self.printed = Path(here.read_text(encoding="utf-8").strip()), done.stdout
        if str(done.returncode) not in code.split(","):
            raise block.error(f"exit code {done.returncode}\n{block.text}\nsaid\n{done.stdout}")

    def compute(self, block: Block, _: str) -> None:
        """Have Python do it."""
        said = io.StringIO()
        with contextlib.chdir(self.folder), contextlib.redirect_stdout(said):
            try:
                exec(compile(block.text, f"{block.page} from line {block.line}", "exec"), self.names)  # noqa: S102
            except Exception as error:
                raise block.error(f"{traceback.format_exc()}\n{block.text}") from error
        self.printed = said.getvalue()

    def compare(self, block: Block, _: str) -> None:
        """What is shown must be what was printed."""
        checker = doctest.OutputChecker()
        if not checker.check_output(block.text, self.printed, RULES):
            raise block.error(f"the page shows\n{block.text}\nprinted was\n{self.printed}")

    def write(self, block: Block, name: str) -> None:
        """Write a file, as a reader does in an editor."""
        self._keep(block, self.folder / name, block.text)

    def add(self, block: Block, name: str) -> None:
        """Add to the end of a file."""
        path = self.folder / name
        self._keep(block, path, path.read_text(encoding="utf-8") + block.text)

    def edit(self, block: Block, name: str) -> None:
        """Change the lines of keys in their tables."""
        path, place = self.folder / name, 0
        lines = path.read_text(encoding="utf-8").splitlines()
        for line in block.text.splitlines():
            if line.startswith("["):
                place = _found(block, lines, line.split("#")[0].strip(), 0) + 1
            elif key := line.partition(" = ")[0].strip():
                lines[_found(block, lines, f"{key} = ", place)] = line
        self._keep(block, path, "\n".join([*lines, ""]))

    def _keep(self, block: Block, path: Path, text: str) -> None:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
        if path.suffix == ".toml":
            _parse(block, text)


Doing = Callable[[Reader, Block, str], None]
MARKS: dict[str, Doing] = {
    "hardware": Reader.check_words,
    "make": Reader.check_words,
    "message": Reader.look_up,
    "output": Reader.compare,
    "file": Reader.write,
    "more": Reader.add,
    "set": Reader.edit,
}
LANGUAGES: dict[str, Doing] = {
    "bash": Reader.carry_out,
    "python": Reader.compute,
    "toml": Reader.parse,
    "text": Reader.pass_by,
    "": Reader.pass_by,
}


def _found(block: Block, lines: list[str], begins: str, place: int) -> int:
    """The line that begins so, from a place on and within its table."""
    for number in range(place, len(lines)):
        if lines[number].startswith(begins):
            return number
        if place and lines[number].startswith("["):
            break
    raise block.error(f"the file has no line that begins with {begins!r} there")


def blocks(page: Path, text: str) -> Iterator[Block]:
    """The fenced blocks of a page in order; directives of MyST are none."""
    lines = text.splitlines()
    start: int | None = None
    for number, line in enumerate(lines):
        if start is None and re.match(r" *```[^`]*$", line):
            start = number
        elif start is not None and re.match(r" *```\s*$", line):
            indent = len(lines[start]) - len(lines[start].lstrip())
            language, *words = lines[start].strip().removeprefix("```").split() or [""]
            code = "".join(f"{one[indent:]}\n" for one in lines[start + 1 : number])
            if not language.startswith("{"):
                yield Block(page, start + 2, language, tuple(words), code)
            start = None
    if start is not None:
        raise BlockError(f"{page}:{start + 1}: the block has no end")


@cache
def _spoken() -> str:
    """All code of the program, as if each text stood on one line."""
    folders = (ROOT / name for name in ("device", "experiments", "analysis", "recoil"))
    code = "".join(path.read_text(encoding="utf-8") for folder in folders for path in sorted(folder.rglob("*.py")))
    return _plain(re.sub(r'"\n\s*f?"', "", code))


def _plain(text: str) -> str:
    return " ".join(text.replace("\\", "").split())


def _parse(block: Block, text: str) -> None:
    try:
        tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise block.error(f"no TOML: {error}") from error


# commands that are not run


def refused(command: str) -> str | None:
    """Why there is no such command of Recoil or make; None for others and for those that there are."""
    words = shlex.split(command, comments=True)
    words = words[next((i for i, word in enumerate(words) if Path(word).name in ("recoil", "make")), len(words)) :]
    if words[:1] == ["make"]:
        targets = re.findall(r"^([a-z]+):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE)
        return next((f"the Makefile has no target {word!r}" for word in words[1:] if word not in targets), None)
    return _refused(words[1:]) if words else None


def _refused(words: list[str]) -> str | None:
    found = typer.main.get_command(app)
    while isinstance(found, TyperGroup) and words and not words[0].startswith("-"):
        named = found.commands.get(words[0])
        if named is None:
            return None if PLACEHOLDER.match(words[0]) else f"there is no command {words[0]!r}"
        found, words = named, words[1:]
    options = {name for one in found.params for name in (*one.opts, *one.secondary_opts)} | {"--help"}
    unknown = (word for word in words if re.match(r"--[a-z]", word) and word.partition("=")[0] not in options)
    return next((f"`recoil {found.name}` has no option {word}" for word in unknown), None)


def check_text(page: Path, text: str) -> None:
    """`BlockError` for a command in the text of a page that there is not."""
    for number, line in enumerate(text.splitlines(), 1):
        for command in INLINE.findall(line):
            try:
                why = refused(command)
            except ValueError:  # a quotation mark of the language, not of the shell
                why = None
            if why:
                raise BlockError(f"{page}:{number}: {why}")


# pages


def pages() -> list[Path]:
    """The README and every page under docs, those made from the code as well."""
    found = (path for path in sorted((ROOT / "docs").rglob("*.md")) if not set(BUILT) & set(path.parts))
    return [ROOT / "README.md", *found]


def check_statistics(page: Path, folder: Path) -> None:
    """`BlockError` for a `statistics.json` that was made and is not as its JSON Schema says."""
    validator = Draft202012Validator(statistics_schema.schema())
    for path in sorted(folder.rglob("statistics.json")):
        for error in validator.iter_errors(json.loads(path.read_text(encoding="utf-8"))):
            raise BlockError(f"{page}: {path.relative_to(folder)}: {error.json_path}: {error.message[:300]}")


def run_page(page: Path) -> str | None:
    """Follow a page from an empty folder; what went wrong, if anything did."""
    with tempfile.TemporaryDirectory() as folder:
        scratch = Path(folder) / "scratch"
        scratch.mkdir()
        (scratch / ".venv").symlink_to(ROOT / ".venv")  # what a reader has who did what the README says first
        reader, text, shown = Reader(scratch), page.read_text(encoding="utf-8"), page.relative_to(ROOT)
        try:
            check_text(shown, text)
            for block in blocks(shown, text):
                reader.follow(block)
            check_statistics(shown, scratch)
        except BlockError as error:
            return str(error)
    return None


def _work(page: Path) -> int:
    """How much there is to do on a page, so that the longest come first."""
    return len(re.findall("^recoil (?:analyze|power|fit|design|audit)", page.read_text(encoding="utf-8"), re.MULTILINE))


def _timed(page: Path) -> tuple[Path, float, str | None]:
    begun_s = time.monotonic()
    why = run_page(page)
    return page, time.monotonic() - begun_s, why


def _stand_in(folder: Path) -> None:
    """A `recoil` without its start: the words go to a server that has everything imported (`tests/warm_start.py`)."""
    os.environ |= {warm_start.FOLDER: str(folder), warm_start.OWNER: str(os.getpid()), "MPLBACKEND": "Agg"}
    program = folder / "recoil"
    program.write_text(f'#!/bin/sh\nexec {shlex.join(warm_start.warm())} "$@"\n', encoding="utf-8")
    program.chmod(0o700)
    os.environ["PATH"] = f"{folder}:{Path(sys.executable).parent}:{os.environ['PATH']}"


def main(named: list[str]) -> int:
    """Run all pages, or those that are named; 1 if a block failed."""
    failed = 0
    with tempfile.TemporaryDirectory() as folder:
        _stand_in(Path(folder))
        chosen = [Path(name).resolve() for name in named] or sorted(pages(), key=_work, reverse=True)
        with multiprocessing.get_context("fork").Pool(maxtasksperchild=1) as pool:
            for page, took_s, why in pool.imap_unordered(_timed, chosen, chunksize=1):
                failed += why is not None
                print(f"{page.relative_to(ROOT)}: {f'{took_s:.1f} s' if why is None else 'FAILED'}", flush=True)
                if why is not None:
                    print(why, file=sys.stderr, flush=True)
    print(f"{len(chosen)} pages, {failed} failed")
    return int(failed > 0)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
