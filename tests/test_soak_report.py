"""The same logs give the same files, byte for byte, in whatever surroundings, kept as a table: `make soak`."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import pytest

from tests.conftest import RECOIL, Soak
from tests.surroundings import ELSEWHERE, HERE, write_sites

pytestmark = pytest.mark.soak


def test_every_file_of_an_analysis_is_alike_byte_for_byte(tmp_path: Path, soak: Soak) -> None:
    sites = write_sites(tmp_path / "sites")
    changes = {
        "as it is": ({}, sites),
        "paths in another order": ({}, sites[::-1]),
        **{f"{name} = {value}": ({name: value}, sites) for name, value in ELSEWHERE.items()},
        "all at once": (ELSEWHERE, sites[::-1]),
    }
    found: dict[str, dict[str, bytes]] = {}
    for name, (environment, paths) in changes.items():
        out = tmp_path / f"out{len(found)}"
        place = {"PATH": os.environ["PATH"], "HOME": str(tmp_path)}
        words = [RECOIL, "analyze", *paths, "--out", out, "--fits"]
        done = subprocess.run(words, cwd=tmp_path, env=place | HERE | environment, capture_output=True, check=False)
        assert done.returncode == 1, done.stderr
        files = (path for path in out.rglob("*") if path.is_file())
        found[name] = {path.relative_to(out).as_posix(): path.read_bytes() for path in files}
    first = found["as it is"]
    for name, files in found.items():
        alike = [path for path, content in files.items() if first.get(path) == content]
        soak("alike byte for byte", f"{len(alike)} of {len(first)} files", "all", name)
        assert files == first, name
