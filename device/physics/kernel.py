"""What marks a function as part of the kernel: plain Python over floats, which a compiler may take as it is.

A session runs these functions interpreted, a batch compiled (`device.physics.compiled`); both give the same digits.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol, TypeVar

_Function = TypeVar("_Function", bound=Callable[..., object])

KERNEL: dict[str, Callable[..., object]] = {}
"""The marked functions by name, each after those that it calls."""


class Floats(Protocol):
    """A list of floats, or an array of them."""

    def __getitem__(self, index: int, /) -> float: ...

    def __setitem__(self, index: int, value: float, /) -> None: ...


def kernel(function: _Function) -> _Function:
    """The function itself, marked. Its name is unique in the kernel."""
    if function.__name__ in KERNEL:
        raise ValueError(f"the kernel has a function {function.__name__} already")
    KERNEL[function.__name__] = function
    return function


@kernel
def clear(row: Floats, size: int, number: float) -> None:
    """A row of one number."""
    for n in range(size):
        row[n] = number
