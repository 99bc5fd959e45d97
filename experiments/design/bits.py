"""The bits of every draw: those of numpy's PCG64 seeded through SeedSequence, made here without numpy.

What a design's check and a session draw are a few hundred numbers, which need no library that takes longer to load
than they take to draw. numpy promises never to change these bits; tests hold ours against its own.

    s' = a s + c mod 2^128, given out as the upper half of s' xor its lower half, turned right by its upper 6 bits

Sources: O'Neill 2014, PCG: a family of simple fast space-efficient statistically good algorithms, HMC-CS-2014-0905,
section 6.3.3 (XSL-RR); of the seed O'Neill 2015, Developing a seed_seq alternative (`randutils`), as numpy has it.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise

_MULTIPLIER = 0x2360ED051FC65DA44385DF649FCCF645
_WORD, _LONG, _LONGEST = 2**32 - 1, 2**64 - 1, 2**128 - 1
_POOL = 4
_LONGEST_SEED = 8
"""Words of 32 bits."""


def _hash_steps(first: int, factor: int, count: int) -> tuple[tuple[int, int], ...]:
    """What each hash in turn is mixed with and then multiplied by: they depend on no seed."""
    constants = [first]
    for _ in range(count):
        constants.append(constants[-1] * factor & _WORD)
    return tuple(pairwise(constants))


_INTO_POOL = _hash_steps(0x43B0D7E5, 0x931E8875, _POOL * _LONGEST_SEED)
_OUT_OF_POOL = _hash_steps(0x8B51F9DD, 0x58F38DED, 8)


class Pcg64:
    """The stream of a seed, a whole number from 0 to 2^256 - 1.

    >>> Pcg64(1).draw()
    9441442522235856127
    """

    __slots__ = ("_increment", "_state")

    def __init__(self, seed: int) -> None:
        start, start_low, step, step_low = _four_words(_stirred(seed))
        self._increment = ((step << 64 | step_low) << 1 | 1) & _LONGEST
        self._state = ((self._increment + (start << 64 | start_low)) * _MULTIPLIER + self._increment) & _LONGEST

    def draw(self) -> int:
        """The next whole number from 0 to 2^64 - 1."""
        self._state = state = (self._state * _MULTIPLIER + self._increment) & _LONGEST
        mixed, turn = (state >> 64 ^ state) & _LONG, state >> 122
        return (mixed >> turn | mixed << 64 - turn) & _LONG


def _stirred(seed: int) -> Sequence[int]:
    """The pool of four words, each of which every word of the seed has been mixed into."""
    words = [seed >> 32 * at & _WORD for at in range(max(_POOL, -(-seed.bit_length() // 32)))]
    steps = iter(_INTO_POOL)
    pool = [_hashed(word, steps) for word in words[:_POOL]]
    for source in range(_POOL):
        for at in range(_POOL):
            if at != source:
                pool[at] = _mixed(pool[at], _hashed(pool[source], steps))
    for word in words[_POOL:]:
        for at in range(_POOL):
            pool[at] = _mixed(pool[at], _hashed(word, steps))
    return pool


def _hashed(word: int, steps: Iterator[tuple[int, int]]) -> int:
    before, factor = next(steps)
    word = (word ^ before) * factor & _WORD
    return word ^ word >> 16


def _mixed(one: int, other: int) -> int:
    word = (0xCA01F9DD * one - 0x4973F715 * other) & _WORD
    return word ^ word >> 16


def _four_words(pool: Sequence[int]) -> Iterator[int]:
    """Words of 64 bits, of the pool gone through twice."""
    steps = iter(_OUT_OF_POOL)
    words = [_hashed(word, steps) for word in (*pool, *pool)]
    return (low | high << 32 for low, high in zip(words[::2], words[1::2], strict=True))
