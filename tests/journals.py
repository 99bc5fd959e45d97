"""Journals as they stand on the disk: their lines, unchecked; and how soon answers were there."""

from __future__ import annotations

import json
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

from experiments.config.setup import canonical_json, sha256
from experiments.design.plan import Plan
from experiments.record.journal import Record, link_of, record_line


def raw(path: Path) -> list[dict[str, Any]]:
    """The whole records of a journal, as plain JSON values."""
    data = path.read_bytes()
    return [json.loads(line) for line in data[: data.rfind(b"\n") + 1].splitlines()]


def write_head(path: Path, plan: Plan) -> None:
    """A journal whose run has only begun, with an empty setup."""
    parts = {"plan": plan.record(), "setup": {}}
    hashes = {f"{name}_sha256": sha256(part) for name, part in parts.items()}
    times = {"utc": "2026-01-01T00:00:00Z", "monotonic_s": 0.0, "clock": "real"}
    path.write_bytes(canonical_json({"n": 0, "kind": "run", "link": "", **times, **parts, **hashes}) + b"\n")


def forged(entries: Sequence[dict[str, Any]]) -> bytes:
    """Records as lines whose numbers and links are right, whatever they say."""
    lines: list[bytes] = []
    for n, entry in enumerate(entries):
        before = link_of(lines[-1]) if lines else ""
        lines.append(record_line(entry | {"n": n, "link": before}))
    return b"".join(lines)


def key_to_disk_ms(records: tuple[Record, ...]) -> list[float]:
    """From the key of each answer to its record on the disk, in order of the trials."""
    found, pulse_s = [], 0.0
    for record, following in pairwise(records):
        body = record.body if isinstance(record.body, dict) else {}
        if body.get("kind") == "fired":
            pulse_s = body["pulse_start_s"]
        elif body.get("kind") == "answered":
            assert following.synced_s is not None
            found.append(1000 * (following.synced_s - pulse_s - body["response_time_s"]))
    return found
