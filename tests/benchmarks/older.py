"""An older version's batch of shots in this process, to be set against ours in one run."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import ModuleType
from typing import Any


def older_batch(folder: Path, **options: Any) -> Callable[..., Any]:
    """`simulate_batch` of the version in a folder, of its gun with these options, beside ours of the same name."""
    theirs: dict[str, ModuleType] = {}
    with _modules(folder, theirs):
        batch = importlib.import_module("device.physics.batch")
        gun = importlib.import_module("device.parameters").GunParameters(**options)
    assert Path(str(batch.__file__)).is_relative_to(folder)

    def simulate_batch(**arrays: Any) -> Any:
        with _modules(folder, theirs):  # it imports more when it first needs it
            return batch.simulate_batch(gun, **arrays)

    return simulate_batch


@contextmanager
def _modules(folder: Path, theirs: dict[str, ModuleType]) -> Iterator[None]:
    """Their modules under the names that are ours."""
    ours = _taken_away()
    sys.modules.update(theirs)
    sys.path.insert(0, str(folder))
    try:
        yield
    finally:
        sys.path.remove(str(folder))
        theirs.update(_taken_away())
        sys.modules.update(ours)


def _taken_away() -> dict[str, ModuleType]:
    return {name: sys.modules.pop(name) for name in list(sys.modules) if name.split(".")[0] == "device"}
