"""Shards of `recoil power`: however the work is divided, it comes to the bytes of one run, or it is said why not."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as some

from analysis.predict.power import run as feature
from analysis.predict.power.grid import Chunk, PowerRequest, make_grid, run_chunk
from analysis.predict.power.planned import Tally
from analysis.predict.power.shards import Job, Shard, ShardNumber, read_shard, write_shard
from analysis.report.terminal import unseen
from device.messages import RecoilError
from experiments.config.door import ConfigError
from tests.power_files import files

SMALL = PowerRequest(config="preference", participants="5-7", effects="0.5,1", studies=20)
CHUNKS = make_grid(SMALL).chunks()


@pytest.fixture(scope="module")
def parts(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The small grid as three shards, the last first, each in a folder of its own as some schedulers have it."""
    folder = tmp_path_factory.mktemp("parts")
    for number in (3, 1, 2):
        feature.power_shard(SMALL, ShardNumber(number=number, of=3), folder / str(number), unseen, workers=1)
    return folder


@pytest.fixture
def mine(parts: Path, tmp_path: Path) -> Path:
    """Those shards, to be spoilt."""
    return Path(shutil.copytree(parts, tmp_path / "mine"))


def merge(folder: Path, request: PowerRequest | None = None) -> None:
    feature.merged_power(folder, request or PowerRequest(config=""), folder / "merged")


@pytest.mark.slow
def test_three_shards_give_the_bytes_of_one_run(mine: Path, tmp_path: Path) -> None:
    feature.power(SMALL, tmp_path / "one", unseen, workers=1)
    merge(mine)
    assert files(mine / "merged") == files(tmp_path / "one")


ONE_RUN = [run_chunk(chunk) for chunk in CHUNKS]


@settings(max_examples=8)
@given(of=some.integers(1, 12), random=some.randoms())
def test_any_division_in_any_order_has_every_piece_once_with_the_same_numbers(of: int, random: object) -> None:
    numbers = list(range(1, of + 1))
    random.shuffle(numbers)  # type: ignore[attr-defined]
    found = dict[int, Tally]()
    for number in numbers:
        for piece in ShardNumber(number=number, of=of).pieces(CHUNKS)[::-1]:
            assert piece not in found
            found[piece] = run_chunk(CHUNKS[piece])
    assert [found[piece] for piece in range(len(CHUNKS))] == ONE_RUN


@settings(max_examples=30)
@given(studies=some.lists(some.integers(1, 5_000), min_size=1, max_size=60), of=some.integers(1, 70))
def test_no_shard_has_more_work_than_another_by_more_than_a_piece(studies: list[int], of: int) -> None:
    chunks: list[Chunk] = [replace(CHUNKS[0], studies=count) for count in studies]
    pieces = [ShardNumber(number=number, of=of).pieces(chunks) for number in range(1, of + 1)]
    assert sorted(piece for one in pieces for piece in one) == list(range(len(chunks)))
    work = [sum(chunks[piece].people for piece in one) for one in pieces]
    assert max(work) - min(work) <= max(chunk.people for chunk in chunks)


NUMBERS = some.floats(allow_nan=False)
TALLIES = some.builds(
    Tally,
    studies=some.integers(0, 10**7),
    held=some.dictionaries(some.sampled_from("bac′"), some.integers(0, 10**7)),
    sums=some.dictionaries(some.sampled_from("bac′"), some.tuples(NUMBERS, NUMBERS)),
    mean_squares=some.tuples(NUMBERS, NUMBERS),
)


@settings(max_examples=20, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(tallies=some.dictionaries(some.integers(0, 10**6), TALLIES, max_size=2))
def test_a_shard_is_read_as_it_was_written_to_the_last_bit_and_in_its_order(
    tallies: dict[int, Tally], tmp_path: Path
) -> None:
    job = Job(sha256="0", request=SMALL, provenance={"numpy": "2"})
    shard = Shard(part=ShardNumber(number=2, of=5), job=job, tallies=tallies)
    again = read_shard(write_shard(tmp_path, shard))
    assert again == shard
    for number, tally in tallies.items():
        assert list(again.tallies[number].held) == list(tally.held)


def test_a_shard_that_is_cut_anywhere_is_refused_by_its_name(mine: Path) -> None:
    path = mine / "2/shard-2-of-3.json"
    whole = path.read_bytes()
    for length in range(0, len(whole) - 1, 97):
        path.write_bytes(whole[:length])
        with pytest.raises(ConfigError, match=r"2/shard-2-of-3\.json: cannot be used \(.*run its job again"):
            merge(mine)


def test_a_byte_that_went_wrong_is_noticed(mine: Path) -> None:
    path = mine / "1/shard-1-of-3.json"
    whole = path.read_bytes()
    for place in range(0, len(whole) - 1, 61):
        path.write_bytes(whole[:place] + bytes([whole[place] ^ 1]) + whole[place + 1 :])
        with pytest.raises(ConfigError, match=r"1/shard-1-of-3\.json: cannot be used"):
            read_shard(path)


def remove(*numbers: int) -> Callable[[Path], None]:
    def spoil(folder: Path) -> None:
        for number in numbers:
            shutil.rmtree(folder / str(number))

    return spoil


def double(folder: Path) -> None:
    shutil.copytree(folder / "2", folder / "4")


def another(number: int = 3, **options: object) -> Callable[[Path], None]:
    def spoil(folder: Path) -> None:
        request = replace(SMALL, **options)  # type: ignore[arg-type]
        (folder / f"{number}/shard-{number}-of-3.json").unlink()
        feature.power_shard(request, ShardNumber(number=number, of=3), folder / f"{number}", unseen, workers=1)

    return spoil


def of_another_version(folder: Path) -> None:
    path = folder / "1/shard-1-of-3.json"
    shard = read_shard(path)
    write_shard(
        path.parent, replace(shard, job=replace(shard.job, provenance={**shard.job.provenance, "numpy": "1.0"}))
    )


def of_another_config(folder: Path) -> None:
    path = folder / "1/shard-1-of-3.json"
    shard = read_shard(path)
    write_shard(path.parent, replace(shard, job=replace(shard.job, sha256="f" * 64)))


def divided_otherwise(folder: Path) -> None:
    feature.power_shard(SMALL, ShardNumber(number=4, of=64), folder, unseen, workers=1)


def config_gone(folder: Path) -> None:
    path = folder / "1/shard-1-of-3.json"
    shard = read_shard(path)
    gone = replace(shard.job.request, config="gone.toml")
    write_shard(path.parent, replace(shard, job=replace(shard.job, request=gone)))


FAULTS: dict[str, tuple[Callable[[Path], None], str]] = {
    "one is missing": (remove(2), "mine: shard-2-of-3.json is missing; run its job with --shard 2/3"),
    "two are missing": (remove(1, 2), "2 of 3 shards are missing, shard-1-of-3.json is the first; .* takes them: 1-2"),
    "all are missing": (remove(1, 2, 3), "--merge .*mine: holds no shard-K-of-N.json; write them with --shard K/N"),
    "one is doubled": (double, r"4/shard-2-of-3.json: is shard 2/3, as .*2/shard-2-of-3.json is; leave one"),
    "another seed": (another(seed=2), r"3/shard-3-of-3.json: is no shard of this job \(seed 2, not 1\)"),
    "other options": (another(studies=9, trials=None, effects="1"), r"\(effects 1, not 0.5,1; studies 9, not 20\)"),
    "another target": (another(target=0.9), r"\(target 0.9, not 0.8\)"),
    "another version": (of_another_version, r"1/shard-1-of-3.json: .* \(numpy 1.0, not "),
    "another config": (of_another_config, r"1/shard-1-of-3.json: .* \(what its config, or the gun"),
    "another division": (divided_otherwise, "shard-4-of-64.json: is one of 64 shards, .*shard-1-of-3.json one of 3"),
    "no config": (config_gone, r"gone.toml: no such file(?s:.*)1/shard-1-of-3.json: was run with config gone.toml"),
}


@pytest.mark.slow
@pytest.mark.parametrize("fault", FAULTS)
def test_shards_that_do_not_make_one_run_are_named_and_nothing_is_written(fault: str, mine: Path) -> None:
    spoil, said = FAULTS[fault]
    spoil(mine)
    with pytest.raises(RecoilError, match=said):
        merge(mine)
    assert not (mine / "merged").exists()


@pytest.mark.parametrize("number", [1, 2, 3])
def test_the_shard_that_does_not_belong_is_named_and_none_that_does(number: int, mine: Path) -> None:
    another(number, seed=2)(mine)
    with pytest.raises(ConfigError) as refused:
        merge(mine)
    (said,) = str(refused.value).splitlines()
    assert said.startswith(
        f"{mine}/{number}/shard-{number}-of-3.json: is no shard of this job (seed 2, not 1), as 2 of 3 "
    )


def test_of_a_job_that_was_divided_twice_the_fewer_shards_are_named(mine: Path) -> None:
    feature.power_shard(SMALL, ShardNumber(number=1, of=2), mine, unseen, workers=1)
    with pytest.raises(ConfigError, match=r"^\S*/shard-1-of-2.json: is one of 2 shards, .*shard-1-of-3.json one of 3"):
        merge(mine)


def test_a_merge_for_other_options_than_those_of_the_shards_is_refused(mine: Path) -> None:
    with pytest.raises(ConfigError, match=r"shard-1-of-3.json: .* \(seed 1, not 2\)"):
        merge(mine, replace(SMALL, seed=2))
    with pytest.raises(ConfigError, match="without CONFIG takes the options of the shards"):
        merge(mine, PowerRequest(config="", seed=2))


@contextmanager
def interrupted(_: str, __: int) -> Iterator[Callable[[str], None]]:
    """A Ctrl-C after the first piece."""

    def tell(_: str) -> None:
        raise KeyboardInterrupt

    yield tell


def test_an_interrupted_shard_goes_on_where_it_was(parts: Path, tmp_path: Path) -> None:
    part = ShardNumber(number=1, of=3)
    with pytest.raises(KeyboardInterrupt):
        feature.power_shard(SMALL, part, tmp_path, interrupted, workers=1)
    (kept,) = tmp_path.iterdir()
    assert len(kept.read_bytes().splitlines()) == 1
    worked_out = list[str]()
    feature.power_shard(SMALL, part, tmp_path, lambda *_: counted(worked_out), workers=1)
    assert files(tmp_path) == files(parts / "1")


@contextmanager
def counted(worked_out: list[str]) -> Iterator[Callable[[str], None]]:
    yield worked_out.append


def test_a_shard_that_is_there_is_not_worked_out_again(parts: Path) -> None:
    def never(_: str, __: int) -> None:
        raise AssertionError

    part = ShardNumber(number=1, of=3)
    again, was_there = feature.power_shard(SMALL, part, parts / "1", never)  # type: ignore[arg-type]
    assert (len(again.tallies), was_there) == (3, True)
    assert "done before and left as it is" in feature.shard_in_short(again, parts / "1", was_there=True)


def test_a_shard_of_another_job_is_not_written_over(mine: Path) -> None:
    before, part = files(mine), ShardNumber(number=1, of=3)
    with pytest.raises(ConfigError, match=r"holds a shard of another job \(seed 1, not 2\)"):
        feature.power_shard(replace(SMALL, seed=2), part, mine / "1", unseen, workers=1)
    assert files(mine) == before
    shutil.copy(mine / "2/shard-2-of-3.json", mine / "1/shard-1-of-3.json")
    with pytest.raises(ConfigError, match=r"holds a shard of another job \(2/3, not 1/3\)"):
        feature.power_shard(SMALL, part, mine / "1", unseen, workers=1)


@pytest.mark.parametrize("make", [Path.mkdir, os.mkfifo], ids=["a folder", "a pipe"])
def test_what_is_no_file_at_a_shards_place_is_named_before_any_work(
    make: Callable[[Path], None], tmp_path: Path
) -> None:
    make(tmp_path / "shard-1-of-3.json")
    with pytest.raises(OSError, match="not a file"):
        feature.power_shard(SMALL, ShardNumber(number=1, of=3), tmp_path, unseen, workers=1)
    with pytest.raises(ConfigError, match=r"shard-1-of-3\.json: cannot be used"):
        feature.merged_power(tmp_path, SMALL, tmp_path / "out")


def test_a_shard_for_which_no_work_is_left_says_so(tmp_path: Path) -> None:
    empty, was_there = feature.power_shard(SMALL, ShardNumber(number=64, of=64), tmp_path, unseen, workers=1)
    told = feature.shard_in_short(empty, tmp_path, was_there=was_there)
    assert "fewer shards would do" in told
    assert "done before" not in told
    assert [path.name for path in tmp_path.iterdir()] == ["shard-64-of-64.json"]
