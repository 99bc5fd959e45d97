"""The full figures behind "no change of an archive goes unnoticed", kept as a table: `make soak`."""

from __future__ import annotations

import random
import time
from pathlib import Path

import pytest

from analysis.archive import archive_export, manifest
from analysis.archive.archive_export import ArchiveRequest
from analysis.archive.verify import verify
from tests.archived_studies import small_study
from tests.conftest import Soak

pytestmark = pytest.mark.soak

CHANGES = 200


@pytest.fixture(scope="module")
def archive(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("archived")
    archive_export.export_archive(ArchiveRequest(folder=small_study(folder / "study"), out=folder / "archive"))
    return folder / "archive"


def test_verify_finds_each_of_200_single_byte_changes(archive: Path, soak: Soak) -> None:
    draw = random.Random(1)
    files = sorted(path for path in archive.rglob("*") if path.is_file() and path.stat().st_size)
    found = named = 0
    for _ in range(CHANGES):
        path = draw.choice(files)
        before = path.read_bytes()
        place = draw.randrange(len(before))
        byte = draw.choice([byte for byte in range(256) if byte != before[place]])
        path.write_bytes(before[:place] + bytes([byte]) + before[place + 1 :])
        said = verify(archive)
        path.write_bytes(before)
        name = path.relative_to(archive).as_posix()
        found += not said.whole
        named += name == manifest.MANIFEST_FILE or any(
            str(fault).startswith(f"{name}: changed") for fault in said.faults
        )
    assert (found, named) == (CHANGES, CHANGES)
    assert verify(archive).whole
    how = f"random file of {len(files)}, random byte, any other value; seed 1"
    soak(f"single-byte changes that `recoil verify` finds, of {CHANGES}", found, f"= {CHANGES}", how)
    soak("of these, with the file named", named, f"= {CHANGES}", "the manifest's own changes named by what they break")


def test_every_byte_of_the_manifest_counts(archive: Path, soak: Soak) -> None:
    path = archive / manifest.MANIFEST_FILE
    before, draw = path.read_bytes(), random.Random(2)
    missed = 0
    for place in range(0, len(before), 7):
        byte = draw.choice([byte for byte in range(256) if byte != before[place]])
        path.write_bytes(before[:place] + bytes([byte]) + before[place + 1 :])
        missed += verify(archive).whole
    path.write_bytes(before)
    assert missed == 0
    soak("changes of the manifest itself that are missed", missed, "= 0", f"every seventh of {len(before)} bytes")


def test_what_verifying_costs_beside_analysing(archive: Path, soak: Soak) -> None:
    start = time.perf_counter()
    assert verify(archive).whole
    whole_s = time.perf_counter() - start
    start = time.perf_counter()
    manifest_only = manifest.read_manifest(archive)
    assert list(manifest.faults(archive, manifest_only)) == []
    hashes_s = time.perf_counter() - start
    soak("hashes of all files, in parts of the whole verification", f"{hashes_s / whole_s:.3f}", "stated", "one run")
