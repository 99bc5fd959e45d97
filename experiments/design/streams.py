"""Named random streams: one a purpose, so that a draw added for one purpose changes no other.

The bits are those of numpy's PCG64 seeded through SeedSequence (`bits`), which numpy promises never to change. What is
made of them (integers, shuffles, uniform and normal numbers) is spelled out here for the same reason.
"""

from __future__ import annotations

import hashlib
import secrets
from collections.abc import Sequence
from statistics import NormalDist
from typing import TYPE_CHECKING, TypeVar

from device.words import is_whole_number
from experiments.config.door import ConfigError
from experiments.config.setup import canonical_json
from experiments.design.bits import Pcg64

if TYPE_CHECKING:
    import numpy as np

Item = TypeVar("Item")

MAX_SEED = 2**63 - 1
_STANDARD_NORMAL = NormalDist()


def draw_seed() -> int:
    """A seed from the operating system, for runs that were given none; it is stored like any other."""
    return secrets.randbelow(MAX_SEED + 1)


def checked_seed(seed: object) -> int:
    """The seed, if it is one. `ConfigError`: anything else than a whole number that a config may hold."""
    if not is_whole_number(seed) or not 0 <= seed <= MAX_SEED:
        raise ConfigError(f"seed = {seed!r}: must be a whole number from 0 to {MAX_SEED}, such as 1")
    return int(seed)


class Stream:
    """A random stream told by a seed and the words that name its purpose.

    >>> Stream(1, "order").shuffled("abc") == Stream(1, "order").shuffled("abc")
    True
    """

    def __init__(self, seed: int, *purpose: str) -> None:
        self._raw = Pcg64(_name(seed, purpose)).draw

    def below(self, bound: int) -> int:
        """An integer from 0 to `bound` - 1, all equally likely (rejection of the incomplete last cycle)."""
        limit = 2**64 - 2**64 % bound
        raw = self._raw()
        while raw >= limit:
            raw = self._raw()
        return raw % bound

    def shuffled(self, items: Sequence[Item]) -> list[Item]:
        """The items in random order (Fisher and Yates)."""
        order = list(items)
        for last in range(len(order) - 1, 0, -1):
            other = self.below(last + 1)
            order[last], order[other] = order[other], order[last]
        return order

    def uniform(self) -> float:
        """A number strictly between 0 and 1, on a grid of 2**-52 shifted by half a step."""
        return ((self._raw() >> 12) + 0.5) * 2.0**-52

    def normal(self) -> float:
        """A standard normal number, by the inverse of its distribution."""
        return _STANDARD_NORMAL.inv_cdf(self.uniform())


def generator(seed: int, *purpose: str) -> np.random.Generator:
    """Numpy's own generator on a named stream, for large arrays; numpy may change its draws between versions."""
    import numpy as np  # noqa: PLC0415 - slow, and whoever draws a few numbers needs none of it

    return np.random.Generator(np.random.PCG64(np.random.SeedSequence(_name(seed, purpose))))


def _name(seed: int, purpose: tuple[str, ...]) -> int:
    """What tells one stream from all others, in 256 bits."""
    return int.from_bytes(hashlib.sha256(canonical_json([seed, *purpose])).digest(), "big")
