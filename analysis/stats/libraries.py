"""The one door to pingouin: it is slow to import, so nobody pays before a result asks for it."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import Any


def pingouin(name: str) -> Callable[..., Any]:
    """A function of pingouin by its name, its import silent: the deprecations in there are for its authors."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        import pingouin as library  # type: ignore[import-untyped, unused-ignore]  # noqa: PLC0415 - takes seconds
    function: Callable[..., Any] = getattr(library, name)
    return function
