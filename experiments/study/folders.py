"""`recoil configs --copy` and `recoil new`: the shipped configs to edit, and a study's folder from them."""

from __future__ import annotations

from pathlib import Path

from experiments.load import shipped_folder
from experiments.record import storage
from experiments.study.places import PlaceError

_README = """# {title}

Edit the configs here; every number of the protocol is in them.

    recoil check study.toml                                   the design, the orders, the duration, the limits
    recoil reproduce --study study.toml --out simulated       the whole study with synthetic participants
    recoil doctor                                             the rig's self-test
    recoil run direction.toml --screen console                sessions at the console, from its start window
    recoil run direction.toml --participant P01               a session on a terminal
    recoil study .                                            who is done, in progress, excluded, next
    recoil analyze results --out analysis                     statistics, figures and report of all logs

Logs go to `results/`; it is readable by its owner only. Use codes for participants, never names.
"""


def shipped() -> list[Path]:
    """The shipped configs, and the examples of what else can be given as a file."""
    return sorted(shipped_folder().glob("*.toml")) + sorted(shipped_folder().glob("examples/*.toml"))


def copy_configs(folder: Path) -> list[Path]:
    """Copy the shipped configs and examples. `PlaceError` if one is there already; then nothing is copied."""
    copies = [(source, folder / source.relative_to(shipped_folder())) for source in shipped()]
    there = [str(target) for _, target in copies if target.exists()]
    if there:
        raise PlaceError(f"{', '.join(there)}: already there; nothing is overwritten, so copy to another folder")
    for source, target in copies:
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_bytes(source.read_bytes())
    return [target for _, target in copies]


def new_study(folder: Path) -> list[Path]:
    """A study's folder: configs, a page that says how to go on, and a private folder for results."""
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise PlaceError(f"{folder}: exists and is not empty; name a new folder")
    made = copy_configs(folder)
    page = folder / "README.md"
    page.write_text(_README.format(title=folder.name), encoding="utf-8")
    storage.make_folder(folder / "results")
    return [*made, page, folder / "results"]
