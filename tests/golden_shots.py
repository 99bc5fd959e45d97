"""golden_shots"""

import json
from pathlib import Path

SHOTS = json.loads((Path(__file__).parent / "golden" / "physics.json").read_text(encoding="utf-8"))["shots"]
