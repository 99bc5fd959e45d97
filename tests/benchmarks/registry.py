"""All peers. A package enters when its peer is prepared, and only if it is installed."""

from __future__ import annotations

from tests.benchmarks import by_diffrax, by_game_loop, by_heyoka, by_mujoco, by_scipy
from tests.benchmarks.problem import Peer


def peers() -> list[Peer]:
    """Every peer at every setting."""
    modules = (by_scipy, by_game_loop, by_heyoka, by_diffrax, by_mujoco)
    return [peer for module in modules for peer in module.peers()]
