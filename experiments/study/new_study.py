"""A study's folder from a template, and the shipped configs to edit."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from experiments.config.door import ConfigError, read_toml
from experiments.config.toml_text import toml_text
from experiments.load import load_setup, shipped_folder
from experiments.record import storage
from experiments.study.folders import PlaceError

_README = """# {title}

Edit the configs here; every number of the protocol is in them.

| command | does |
| --- | --- |
| `recoil check study.toml` | the design, the orders, the duration, the limits |
| `recoil reproduce --study study.toml --out simulated` | the whole study with synthetic participants |
| `recoil freeze .` | a preregistration, whose hash every later run carries |
| `recoil doctor` | the rig's self-test |
| `recoil run direction.toml --screen console` | runs at the console, from its start window |
| `recoil run direction.toml --participant P01` | a run on a terminal |
| `recoil study .` | who is done, in progress, excluded, next |
| `recoil analyze results --out analysis` | statistics, figures and report of all logs |

Logs go to `results/`; it is readable by its owner only, on Windows by whoever may read this folder. Use codes for
participants, never names.
"""


_README_OF_DESIGN = """# {title}

`{name}.toml` is the design: what varies, in which order, what is asked. Edit it, and look at what it comes to:

| command | does |
| --- | --- |
| `recoil check {name}.toml` | the plan as a Methods section, cells, orders, duration |
| `recoil run {name}.toml --participant S01 --screen synthetic --results simulated` | one simulated run |
| `recoil freeze .` | a preregistration, whose hash every later run carries |
| `recoil doctor` | the rig's self-test |
| `recoil run {name}.toml --screen console` | runs at the console, from its start window |
| `recoil study .` | who is done, in progress, excluded, next |
| `recoil analyze results --out analysis` | statistics, figures and report of all logs |

Logs go to `results/`; it is readable by its owner only, on Windows by whoever may read this folder. Use codes for
participants, never names. `study.toml` says how many people there are; who may take part is asked once you write
[eligibility] into it.
"""
_KINDS = ("*.toml", "examples/*.toml", "synthetic/*.toml", "schemas/*.json")
_PEOPLE = ("direction", "direction-felt", "preference", "preference-felt", "hurry-felt")
_OF_THE_PAPER = (
    *("direction.toml", "preference.toml", "gun.toml", "study.toml", "paper.toml"),
    *(f"synthetic/{name}.toml" for name in _PEOPLE),
)


def shipped() -> list[Path]:
    """The shipped configs, who answers them in simulations, examples of what else can be given, and the schemas."""
    return [path for kind in _KINDS for path in sorted(shipped_folder().glob(kind))]


def copy_configs(folder: Path, sources: Iterable[Path] | None = None) -> list[Path]:
    """Copy shipped files, all unless some are named. `PlaceError` if one is there already; then nothing is copied."""
    named = shipped() if sources is None else sources
    copies = [(source, folder / source.relative_to(shipped_folder())) for source in named]
    there = [str(target) for _, target in copies if target.exists()]
    if there:
        raise PlaceError(f"{', '.join(there)}: already there; nothing is overwritten, so copy to another folder")
    for source, target in copies:
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_bytes(source.read_bytes())
    return [target for _, target in copies]


def new_study(folder: Path, design: str = "", *, paper: bool = False) -> list[Path]:
    """A study's folder: configs, a page that says how to go on, and a private folder for results.

    Without a `design` it is the paper's study; with one a study of that alone, for everybody; with `paper` beside the
    paper's numbers. `ConfigError`: there is no such shipped design.
    """
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        there = "has something in it" if folder.is_dir() else "is no folder"
        raise PlaceError(f"{folder}: {there}; name a new folder, or an empty one")
    page, results = folder / "README.md", folder / "results"
    if design:
        made = _study_of(folder, design, paper=paper)
        page.write_text(_README_OF_DESIGN.format(title=folder.name, name=design), encoding="utf-8")
    else:
        its_own = [shipped_folder() / name for name in _OF_THE_PAPER]
        made = copy_configs(folder, [*its_own, *sorted(shipped_folder().glob("examples/*.toml")), *_schemas()])
        page.write_text(_README.format(title=folder.name), encoding="utf-8")
    storage.make_folder(results)
    return [*made, page, results]


def _schemas() -> list[Path]:
    return sorted(shipped_folder().glob("schemas/*.json"))


def _study_of(folder: Path, name: str, *, paper: bool) -> list[Path]:
    """A shipped design with its gun and its synthetic people, and a study that says nothing about who may come."""
    path = shipped_folder() / f"{name}.toml"
    setup = load_setup(name) if name in designs() else None
    if setup is None:
        raise ConfigError(f"--from {name}: no shipped design; there are {', '.join(designs())}")
    laws = setup.config.synthetic
    named = [setup.config.gun, *([laws] if laws else []), *(["paper.toml"] if paper else [])]
    made = copy_configs(folder, [path, *(shipped_folder() / one for one in named), *_schemas()])
    study: dict[str, object] = {"title": f"A study of {setup.config.title}", "participants": 12}
    study |= {"experiments": [path.name]} | ({"paper": "paper.toml"} if paper else {})
    (folder / "study.toml").write_text(f"#:schema schemas/study.json\n{toml_text(study)}", encoding="utf-8")
    return [*made, folder / "study.toml"]


def designs() -> list[str]:
    """The names of the shipped designs."""
    return [path.stem for path in sorted(shipped_folder().glob("*.toml")) if "factors" in read_toml(path)]
