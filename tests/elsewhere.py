"""This system with what another one lacks taken away, to see what is left: `python -m tests.elsewhere win32 WORDS`.

The words are a command of `recoil`, or several with `then` between them, of which the first that fails is the last;
`import` alone imports every module instead. Libraries are imported before, as they know the system that they were made
for: what is seen is our own code alone. No real Windows and no real Mac is like it.
"""

from __future__ import annotations

import importlib
import os
import pkgutil
import signal
import sys
from types import ModuleType

OF_UNIX = ("fcntl", "grp", "pty", "pwd", "readline", "resource", "syslog", "termios", "tty")
LIBRARIES = (
    *("click", "jinja2", "matplotlib.pyplot", "multiprocessing.context", "numpy", "pandas", "pingouin"),
    *("pyarrow.compute", "pyarrow.csv", "pyarrow.parquet", "pydantic", "rich.console", "rich.progress", "rich.table"),
    *("scipy.optimize", "scipy.special", "scipy.stats", "serial", "serial.tools.list_ports", "statsmodels.api"),
    *("asyncio", "numba", "subprocess", "tempfile", "typer.core"),
)
OF_THE_SCREENS = ("PyQt6", "psychopy", "Xlib")
"""Not everybody has them."""
IN_OS = (
    *("O_CLOEXEC", "O_DIRECTORY", "O_NOCTTY", "O_NOFOLLOW", "O_NONBLOCK", "chown", "fchmod", "fork", "forkpty"),
    *("geteuid", "getpgid", "getuid", "killpg", "mkfifo", "nice", "openpty", "posix_spawn", "pread", "pwrite"),
    *("sched_getaffinity", "set_blocking", "setsid", "ttyname", "uname"),
)
IN_SIGNAL = ("SIGALRM", "SIGHUP", "SIGQUIT", "SIGUSR1", "SIGUSR2", "alarm", "pthread_sigmask", "setitimer")


class _Hidden:
    """Finds no module of Unix's."""

    def find_spec(self, name: str, *_: object) -> None:
        if name in OF_UNIX:
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)


def byte_locks() -> ModuleType:
    """Windows' locks of bytes, by those of Unix."""
    import fcntl

    made = ModuleType("msvcrt")

    def locking(descriptor: int, mode: int, count: int) -> None:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)

    vars(made).update(LK_NBLCK=2, locking=locking)
    return made


def be(system: str) -> None:
    """Be another system from now on."""
    for name in LIBRARIES:
        importlib.import_module(name)
    if system == "win32":
        sys.modules["msvcrt"] = byte_locks()
        for name in OF_UNIX:
            sys.modules.pop(name, None)
        sys.meta_path.insert(0, _Hidden())  # type: ignore[arg-type] # it finds nothing
    for module, names in ((os, IN_OS), (signal, IN_SIGNAL)) if system == "win32" else ((os, ("sched_getaffinity",)),):
        for name in names:
            if hasattr(module, name):
                delattr(module, name)
    if system == "darwin":
        import fcntl

        vars(fcntl)["F_FULLFSYNC"] = 51  # which Linux refuses, as a shared folder does on a Mac
    sys.platform = system


def import_all() -> None:
    """Import every module of ours, and say which cannot be, and how many there are."""
    count = 0
    for top in ("device", "experiments", "analysis", "recoil"):
        for found in pkgutil.walk_packages(importlib.import_module(top).__path__, f"{top}."):
            if found.name.endswith("__main__") or "doctor.programs." in found.name:
                continue
            count += 1
            try:
                importlib.import_module(found.name)
            except ModuleNotFoundError as error:
                if (error.name or "").partition(".")[0] not in OF_THE_SCREENS:
                    sys.stdout.write(f"{found.name}: {error}\n")
            except Exception as error:  # noqa: BLE001 - whatever it is, it is told
                sys.stdout.write(f"{found.name}: {type(error).__name__}: {error}\n")
    sys.stdout.write(f"{count} modules\n")


def main() -> None:
    be(sys.argv[1])
    words = sys.argv[2:]
    if words == ["import"]:
        import_all()
        return
    from recoil.cli import main as recoil

    while "then" in words:
        sys.argv[:] = ["recoil", *words[: words.index("then")]]
        del words[: words.index("then") + 1]
        try:
            recoil()
        except SystemExit as ended:
            if ended.code:
                raise
    sys.argv[:] = ["recoil", *words]
    recoil()


if __name__ == "__main__":
    main()
