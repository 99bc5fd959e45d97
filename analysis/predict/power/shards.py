"""Shards of `recoil power`: the work of one run in N parts, each a job of its own under any scheduler, and their files.

A shard's file holds what was counted in its studies, piece by piece, so that all shards come to the numbers of one run.
"""

from __future__ import annotations

import hashlib
import json
import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from itertools import groupby
from pathlib import Path

from pydantic import TypeAdapter

from analysis.predict.power.grid import Chunk, PowerRequest
from analysis.predict.power.planned import Tally
from experiments.config.door import ConfigError
from experiments.record import storage

_MOST = 100_000
"""More shards than any scheduler takes."""
_FILES = {"config", "paper"}
"""Options that say where files lie: jobs are the same if these hold the same."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ShardNumber:
    """Shard `number`, from 1, of so many (`of`)."""

    number: int
    of: int

    def __str__(self) -> str:
        return f"{self.number}/{self.of}"

    @property
    def file_name(self) -> str:
        """What its file is called."""
        return f"shard-{self.number}-of-{self.of}.json"

    def pieces(self, chunks: Sequence[Chunk]) -> list[int]:
        """The numbers of its chunks: all are dealt out in turn, those that draw the most people first."""
        by_people = sorted(range(len(chunks)), key=lambda number: -chunks[number].people)
        return sorted(by_people[self.number - 1 :: self.of])


def shard_number(text: str) -> ShardNumber:
    """The shard that `--shard` names. `ConfigError` unless it is K/N with K from 1 to N."""
    match = re.fullmatch(r"\s*([0-9]{1,9})\s*/\s*([0-9]{1,9})\s*", text, re.ASCII)
    if not match:
        raise ConfigError(f"--shard {text}: must be K/N, as in 3/64 for the third of 64 shards")
    part = ShardNumber(number=int(match[1]), of=int(match[2]))
    if not 1 <= part.of <= _MOST:
        raise ConfigError(f"--shard {text}: there must be from 1 to {_MOST} shards, not {part.of}")
    if not 1 <= part.number <= part.of:
        raise ConfigError(f"--shard {text}: shards are counted from 1 to {part.of}, so there is no {part.number}")
    return part


@dataclass(frozen=True, slots=True, kw_only=True)
class Job:
    """The whole run that a shard is a part of. `sha256` is of all that its tallies depend on."""

    sha256: str
    request: PowerRequest
    provenance: Mapping[str, str]

    @property
    def key(self) -> str:
        """The same for shards of one job."""
        options = [getattr(self.request, one.name) for one in fields(PowerRequest) if one.name not in _FILES]
        return repr((self.sha256, options, sorted(self.provenance.items())))

    def unlike(self, other: Job) -> str:
        """What sets this job apart from another, in words; nothing if they are the same."""
        here, there = asdict(self.request), asdict(other.request)
        names = [one.name for one in fields(PowerRequest) if one.name not in _FILES]
        differing = [
            *(f"{name} {_shown(here[name])}, not {_shown(there[name])}" for name in names if here[name] != there[name]),
            *(
                f"{name} {self.provenance.get(name)}, not {of_other}"
                for name, of_other in other.provenance.items()
                if self.provenance.get(name) != of_other
            ),
        ]
        if not differing and self.sha256 != other.sha256:
            return "what its config, or the gun, people or paper of it, held then"
        return "; ".join(differing)


def _shown(value: object) -> str:
    return "the default" if value in (None, ()) else " ".join(value) if isinstance(value, list | tuple) else f"{value}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Shard:
    """A shard that is done: the tally of each of its chunks, by the chunk's number."""

    part: ShardNumber
    job: Job
    tallies: Mapping[int, Tally]


_SHARD = TypeAdapter(Shard)


def write_shard(folder: Path, shard: Shard) -> Path:
    """Its file, whole or not at all."""
    path, content = folder / shard.part.file_name, asdict(shard)
    content["tallies"] = {str(number): tally for number, tally in content["tallies"].items()}
    storage.write_whole(path, json.dumps({"sha256": _hash(content), "shard": content}).encode() + b"\n")
    return path


def _hash(content: object) -> str:
    """The SHA-256 of its JSON as it stands in the file; the order of claims is that of the report."""
    return hashlib.sha256(json.dumps(content).encode()).hexdigest()


def read_shard(path: Path) -> Shard:
    """A shard from its file. `ConfigError` if it is cut, was changed or is none."""
    try:
        storage.check_file(path)
        content = json.loads(path.read_bytes())
        if content["sha256"] == _hash(content["shard"]):
            return _SHARD.validate_python(content["shard"])
        why = "it was changed after it was written"
    except (ValueError, TypeError, KeyError, RecursionError):
        why = "it is cut, or no shard of this version"
    except OSError as error:
        why = error.strerror or str(error)
    raise ConfigError(f"{path}: cannot be used ({why}); copy it once more, or delete it and run its job again")


def shards_in(folder: Path) -> dict[Path, Shard]:
    """All shards in a folder and the folders in it. `ConfigError` if there are none, or for each that is not whole."""
    if not folder.is_dir():
        raise ConfigError(f"--merge {folder}: is no folder; name the one that the jobs wrote to (their --out)")
    paths = sorted(folder.rglob("shard-*-of-*.json"), key=_in_numbers)
    if not paths:
        raise ConfigError(f"--merge {folder}: holds no shard-K-of-N.json; write them with --shard K/N --out {folder}")
    found, refused = dict[Path, Shard](), list[str]()
    for path in paths:
        try:
            found[path] = read_shard(path)
        except ConfigError as error:
            refused.append(str(error))
    if refused:
        raise ConfigError("\n".join(refused))
    return found


def _in_numbers(path: Path) -> tuple[list[int], str]:
    return [int(number) for number in re.findall(r"[0-9]+", path.name)], str(path)


def most_common_job(shards: Mapping[Path, Shard]) -> Path:
    """The first shard of the job that most of the shards are of."""
    keys = {path: one.job.key for path, one in shards.items()}
    most = Counter(keys.values()).most_common(1)[0][0]
    return next(path for path, key in keys.items() if key == most)


def tallies_of(folder: Path, shards: Mapping[Path, Shard], job: Job) -> dict[int, Tally]:
    """The tallies of all chunks of a job. `ConfigError` names each shard that is another's, doubled or missing."""
    of = Counter(one.part.of for one in shards.values()).most_common(1)[0][0]
    faults = (
        list(_others(shards, job))
        or list(_divided(shards, of))
        or list(_doubled(shards))
        or list(_missing(folder, {one.part.number for one in shards.values()}, of))
    )
    if faults:
        raise ConfigError("\n".join(faults))
    return {number: tally for one in shards.values() for number, tally in one.tallies.items()}


def _others(shards: Mapping[Path, Shard], job: Job) -> Iterator[str]:
    differing = {path: one.job.unlike(job) for path, one in shards.items()}
    own = [path for path, how in differing.items() if not how]
    as_these = (
        f", as {len(own):,} of {len(shards):,} here are ({own[0]} is the first)" if 2 * len(own) > len(shards) else ""
    )
    remedy = "run it again as the job's others, or move it away"
    yield from (
        f"{path}: is no shard of this job ({how}){as_these}; {remedy}" for path, how in differing.items() if how
    )


def _divided(shards: Mapping[Path, Shard], of: int) -> Iterator[str]:
    first = next(path for path, one in shards.items() if one.part.of == of)
    for path, one in shards.items():
        if one.part.of != of:
            yield f"{path}: is one of {one.part.of} shards, {first} one of {of}; move those of one away"


def _doubled(shards: Mapping[Path, Shard]) -> Iterator[str]:
    first = dict[ShardNumber, Path]()
    for path, one in shards.items():
        if first.setdefault(one.part, path) != path:
            yield f"{path}: is shard {one.part}, as {first[one.part]} is; leave one of the two"


def _missing(folder: Path, there: set[int], of: int) -> Iterator[str]:
    missing = [number for number in range(1, of + 1) if number not in there]
    if not missing:
        return
    part = ShardNumber(number=missing[0], of=of)
    if len(missing) == 1:
        yield f"{folder}: {part.file_name} is missing; run its job with --shard {part}"
    else:
        yield (
            f"{folder}: {len(missing)} of {of} shards are missing, {part.file_name} is the first; run their jobs with "
            f"--shard {part} and so on; all of them, as a job array takes them: {ranges(missing)}"
        )


def ranges(numbers: Sequence[int]) -> str:
    """Whole numbers that rise, the shortest way.

    >>> ranges([1, 3, 4, 5, 9])
    '1,3-5,9'
    """
    runs = ([number for _, number in run] for _, run in groupby(enumerate(numbers), lambda pair: pair[1] - pair[0]))
    return ",".join(f"{run[0]}-{run[-1]}" if len(run) > 1 else f"{run[0]}" for run in runs)
