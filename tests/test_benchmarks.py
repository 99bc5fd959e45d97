"""The peers against the full model, the count of operations, and who leads."""

from __future__ import annotations

from importlib.util import find_spec
from typing import Any

import pytest

from device.physics import simulate
from device.physics.scenes import OUTPUTS
from tests.benchmarks.flops import counting_floats, operations
from tests.benchmarks.leads import leads
from tests.benchmarks.ours import Contender, Ready, one_at_a_time
from tests.benchmarks.problem import OFF_STATES, Outputs, PeerError, errors, guns, papers_shots, reference
from tests.benchmarks.registry import peers
from tests.benchmarks.timing import Row, measure

pytestmark = pytest.mark.slow

TIGHT = {
    "scipy RK45": "rtol 1e-08",
    "scipy DOP853": "rtol 1e-09",
    "scipy Radau": "rtol 1e-06",
    "scipy BDF": "rtol 1e-09",
    "scipy LSODA": "rtol 1e-09",
    "heyoka": "tol 1e-12",
    "diffrax Tsit5": "rtol 1e-10",
    "diffrax Dopri8": "rtol 1e-10",
}
"""A setting of each peer at which it must agree with us to a millionth."""


@pytest.mark.parametrize("drive_off", OFF_STATES)
@pytest.mark.parametrize("family", TIGHT)
def test_each_peer_finds_what_the_full_model_finds(family: str, drive_off: Any) -> None:
    peer = next(peer for peer in peers() if (peer.family, peer.setting) == (family, TIGHT[family]))
    if find_spec(peer.package) is None:
        pytest.skip(f"{peer.package} is not installed: uv pip install --python .venv --group peers")
    shoot = peer.build(drive_off)
    for gun in guns(drive_off):
        ours = simulate(gun)
        for name, found in zip(OUTPUTS, shoot(gun), strict=True):
            assert found == pytest.approx(getattr(ours, name), rel=1e-6), name


@pytest.mark.parametrize("drive_off", OFF_STATES)
def test_the_game_loop_comes_nearer_as_its_step_shrinks(drive_off: Any) -> None:
    loops = [peer for peer in peers() if peer.family == "RK4 loop, Python"]
    with pytest.raises(PeerError, match="never landed"):  # a millisecond is beyond what its method can follow
        loops[0].build(drive_off)(guns(drive_off)[0])
    found = [[peer.build(drive_off)(gun) for gun in guns(drive_off)] for peer in loops[1:]]
    coarse, fine = (max(errors(one, reference(drive_off)).values()) for one in found)
    assert fine < coarse / 5
    assert fine < 1e-3


def test_the_reference_is_that_of_the_papers_guns_in_fifty_digits() -> None:
    for drive_off in OFF_STATES:
        for gun, digits in zip(guns(drive_off), reference(drive_off), strict=True):
            assert len(digits["reset_end_s"]) > 50
            assert simulate(gun).reset_end_s == pytest.approx(float(digits["reset_end_s"]), rel=1e-12)


def test_an_error_is_the_largest_over_the_guns_and_nan_is_infinite() -> None:
    exact = [dict.fromkeys(OUTPUTS, "2.0"), dict.fromkeys(OUTPUTS, "4.0")]
    found: list[Outputs] = [(2.0,) * 7, (5.0, *(4.0,) * 5, float("nan"))]
    assert list(errors(found, exact).values()) == [0.25, 0, 0, 0, 0, 0, float("inf")]


def test_floats_that_count_count_every_operation_and_stay_what_they_are() -> None:
    number, tally = counting_floats()
    y = number(2.0)
    for c in (1.0, 3.0, 5.0):
        y = y * 0.5 + c  # one multiplication and one addition each
    y = -(1.0 - abs(y)) / number(4.0)
    assert type(y) is number
    assert dict(tally) == {"multiplications": 3, "additions": 4, "divisions": 1}
    assert float(y) == -(1.0 - ((2.0 * 0.5 + 1.0) * 0.5 + 3.0) * 0.5 - 5.0) / 4.0


def test_a_shot_takes_at_least_the_products_of_its_series() -> None:
    """Each of some 8 steps of order 24 has one Cauchy product a coefficient: 24 * 25 / 2 multiplications."""
    for drive_off in OFF_STATES:
        assert operations(guns(drive_off))["multiplications"] > 8 * 24 * 25 / 2


def test_a_peer_that_is_missing_or_fails_is_a_row_and_stops_nobody() -> None:
    def broken(_shots: object) -> Ready:
        raise PeerError("an event was missed")

    def contender(family: str, package: str, prepare: Any, *, is_peer: bool = True) -> Contender:
        return Contender(family=family, setting="", package=package, models="all", prepare=prepare, is_peer=is_peer)

    absent = contender("absent", "no_such_package_at_all", broken)
    failing = contender("failing", "recoil", broken)
    ours = contender("ours", "recoil", one_at_a_time, is_peer=False)
    rows = measure([absent, failing, ours], papers_shots("open"), 1)
    assert [row.status for row in rows] == ["not installed", "failed", "measured"]
    assert "--group peers" in rows[0].note
    assert "an event was missed" in rows[1].note
    assert rows[2].error is not None
    assert rows[2].error < 1e-12
    with pytest.raises(PeerError):  # what is ours must not hide behind a row
        measure([contender("ours", "recoil", broken, is_peer=False)], papers_shots("open"), 1)


def test_a_lead_is_the_fastest_exact_setting_and_says_whether_it_is_what_was_wanted() -> None:
    def row(family: str, error: float, us: float) -> Row:
        return Row(
            drive_off="open", family=family, setting=f"{us}", models="all", error=error, us_per_shot=us, times_ours=us
        )

    rows = [row("scipy DOP853", 1e-6, 10.0), row("scipy DOP853", 1e-10, 600.0), row("scipy DOP853", 1e-12, 900.0)]
    found = leads([*rows, row("heyoka", 1e-15, 1.5), row("scipy BDF", 1e-8, 5.0), row("Recoil, batch", 1e-14, 4.0)])
    assert [(lead.family, lead.us_per_shot, lead.verdict) for lead in found] == [
        ("scipy DOP853", 600.0, "met"),
        ("heyoka", 1.5, "not met"),
        ("Recoil, batch", 4.0, "met"),
    ]
