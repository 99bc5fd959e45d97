"""Without the extra `gui` the modules that need it are not looked through for doctests."""

from importlib.util import find_spec

collect_ignore_glob = [] if find_spec("PyQt6") else ["experiments/screens/console/*", "experiments/doctor/programs/*"]
