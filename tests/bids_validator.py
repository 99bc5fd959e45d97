"""The official validator of BIDS data sets, without a network and with an empty home."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from tests.waiting import PATIENCE_S

VALIDATOR = Path(sys.executable).with_name("bids-validator-deno")
NO_NETWORK = {"HTTP_PROXY": "http://127.0.0.1:9", "HTTPS_PROXY": "http://127.0.0.1:9"}


def validated(folder: Path) -> list[dict[str, Any]]:
    """What it finds in a copy of a data set: it reads nothing below /dev, where the tests' files may lie in memory."""
    with tempfile.TemporaryDirectory() as place:
        copy, home = Path(place, "bids"), Path(place, "home")
        shutil.copytree(folder, copy)
        home.mkdir()
        done = subprocess.run(
            [VALIDATOR, copy, "--format", "json", "--max-rows", "-1"],
            capture_output=True,
            text=True,
            env={"PATH": os.environ["PATH"], "HOME": str(home), "NO_COLOR": "1"} | NO_NETWORK,
            stdin=subprocess.DEVNULL,
            timeout=PATIENCE_S,
            check=False,
        )
    found: list[dict[str, Any]] = json.loads(done.stdout)["issues"]["issues"]
    assert (done.returncode != 0) == any(issue["severity"] == "error" for issue in found), done.stderr
    return found
