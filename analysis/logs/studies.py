"""Logs of several studies or sites: short names for them, and each one's logs alone."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import PurePath


def study_names(folders: Iterable[str]) -> dict[str, str]:
    """Short names for studies' folders: what tells them apart, from the first differing part on; else the last part.

    >>> study_names(["/data/kyoto/results", "/data/oslo/results"])
    {'/data/kyoto/results': 'kyoto', '/data/oslo/results': 'oslo'}
    >>> study_names(["/data/kyoto"])
    {'/data/kyoto': 'kyoto'}
    """
    ways = {folder: PurePath(folder).parts for folder in sorted(folders)}
    shared = _shared(list(ways.values()))
    tails = [way[shared:][::-1] for way in ways.values()]
    behind = _shared(tails)
    ends = {folder: way[shared : len(way) - behind] for folder, way in ways.items()}
    if len(ways) > 1 and all(ends.values()):
        return {folder: "/".join(end) for folder, end in ends.items()}
    return {folder: "/".join(way[shared - 1 :]) for folder, way in ways.items()} if ways else {}


def _shared(ways: list[tuple[str, ...]]) -> int:
    """How many parts all begin with."""
    return next(
        (n for n, parts in enumerate(zip(*ways, strict=False)) if len(set(parts)) > 1), min(map(len, ways), default=0)
    )
