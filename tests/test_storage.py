"""Who holds a file and who only looks: neither stands in the other's way."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import pytest

from experiments.record import storage

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="a lock for all who look is Unix's")


@pytest.fixture
def file(tmp_path: Path) -> Path:
    (tmp_path / "file").touch()
    return tmp_path / "file"


def test_a_file_is_held_from_when_it_is_taken_until_it_is_closed(file: Path) -> None:
    assert not storage.is_held(file)
    descriptor = storage.reopen(file)
    assert not storage.is_held(file)
    assert storage.hold(descriptor)
    assert storage.is_held(file)
    os.close(descriptor)
    assert not storage.is_held(file)


def test_whoever_looks_takes_another_who_looks_for_nobody_who_holds(file: Path) -> None:
    import fcntl

    looking = os.open(file, os.O_RDONLY)
    fcntl.flock(looking, fcntl.LOCK_SH | fcntl.LOCK_NB)
    assert not storage.is_held(file)
    os.close(looking)


def test_a_run_that_begins_while_somebody_looks_waits_until_they_have_looked(
    file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    import fcntl

    looking = os.open(file, os.O_RDONLY)
    fcntl.flock(looking, fcntl.LOCK_SH | fcntl.LOCK_NB)
    descriptor = storage.reopen(file)
    assert not storage.hold(descriptor)  # without patience it is refused
    monkeypatch.setattr(storage.time, "sleep", lambda _: os.close(looking))
    assert storage.hold(descriptor, patience_s=600)
    os.close(descriptor)


def test_a_file_that_is_held_is_refused_when_patience_ends(file: Path) -> None:
    descriptor = storage.reopen(file)
    assert storage.hold(descriptor)
    assert not storage.hold(storage.reopen(file), patience_s=0.05)
    os.close(descriptor)
