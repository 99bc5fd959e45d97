"""In which unit the bounds of an equivalence test are, said at check and at the freeze."""

from __future__ import annotations

from pathlib import Path

from analysis.archive.preregistration import freeze
from analysis.predict.check import check, check_text
from experiments.clock import RealClock
from experiments.study.new_study import new_study

REQUEST = """[[requests]]
kind = "equivalence"
of = "magnitude"
a = "0.004"
b = "0.018"
low = -5.0
high = 5.0
"""


def test_bounds_of_magnitude_estimates_are_said_to_be_logarithms_and_as_ratios(tmp_path: Path) -> None:
    study = tmp_path / "study"
    new_study(study, "magnitude")
    (study / "requests.toml").write_text(REQUEST)
    with (study / "study.toml").open("a") as file:
        file.write('\n[preregistration]\nrequests = "requests.toml"\n')
    said = (
        "low = -5 and high = 5 of the equivalence test are in natural logarithms of the numbers: the ratio of 0.004 to "
        "0.018 between 0.00674 and 148"
    )
    assert said in " ".join(check_text(check(str(study / "study.toml"), None, 1)).split())
    assert said in " ".join(freeze(study, "", RealClock()).preregistration.words.split())
