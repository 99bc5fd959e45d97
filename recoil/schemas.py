"""JSON Schemas of every kind of config, those of the desk among them: an editor that reads them checks keys."""

from __future__ import annotations

import json
from pathlib import Path

from pydantic import BaseModel

from experiments.config.door import StudyConfig
from experiments.config.setup import GunConfig
from experiments.design.config import DesignConfig
from experiments.synthetic.laws import SyntheticAnswers


def schemas() -> dict[str, bytes]:
    """A JSON Schema of each kind of config, by file name: an editor that reads them completes and checks keys."""
    from analysis.logs.column_map import ColumnMap  # noqa: PLC0415 - the lab's own kinds come without the desk
    from analysis.logs.exclusion_rules import Rules  # noqa: PLC0415
    from analysis.logs.level_map import LevelMap  # noqa: PLC0415
    from analysis.paper.paper import Paper  # noqa: PLC0415
    from analysis.summary.remarks_coding import Codebook  # noqa: PLC0415
    from analysis.summary.requests import Requests  # noqa: PLC0415

    kinds: dict[str, type[BaseModel]] = {
        "design": DesignConfig,
        "synthetic": SyntheticAnswers,
        "gun": GunConfig,
        "study": StudyConfig,
        "paper": Paper,
        "columns": ColumnMap,
        "levels": LevelMap,
        "rules": Rules,
        "codebook": Codebook,
        "requests": Requests,
    }
    return {f"{name}.json": _schema(name, kind) for name, kind in kinds.items()}


def _schema(name: str, kind: type[BaseModel]) -> bytes:
    head = {"$schema": "https://json-schema.org/draft/2020-12/schema", "title": f"Recoil: {name}"}
    return (json.dumps(kind.model_json_schema() | head, indent=1, ensure_ascii=False, sort_keys=True) + "\n").encode()


def write_schemas(folder: Path) -> list[Path]:
    """Write the schema of each kind of config into a folder; those that are there are written anew."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, content in schemas().items():
        (folder / name).write_bytes(content)
    return [folder / name for name in schemas()]
