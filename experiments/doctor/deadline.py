"""Work that may hang, such as a dead network disk or a silent gun, is waited for no longer than its time."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import TypeVar

Result = TypeVar("Result")

_PUT_AWAY_S = 2.0


def within(seconds: float, work: Callable[[], Result]) -> Result:
    """The result of some work, or what it raises. `TimeoutError` if it takes longer; it is then left to itself."""
    results: list[Result] = []
    errors: list[Exception] = []
    done = threading.Event()  # not `join`: once interrupted, it takes the thread for ended

    def carry_out() -> None:
        try:
            results.append(work())
        except Exception as error:  # noqa: BLE001 - raised again where it is waited for
            errors.append(error)
        finally:
            done.set()

    try:
        threading.Thread(target=carry_out, daemon=True, name="check").start()
        done.wait(seconds)
    except KeyboardInterrupt:
        done.wait(_PUT_AWAY_S)  # so that it can close and remove what it opened
        raise
    if errors:
        raise errors[0]
    if not results:
        raise TimeoutError(f"did not end within {seconds:g} s")
    return results[0]
