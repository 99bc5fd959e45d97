"""`recoil fit percept`: the fit as a user gets it, and the judgement of it by what was not fitted."""

from __future__ import annotations

import json
import re
import shutil
import tomllib
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy import stats

from analysis.paper.paper import load_paper
from analysis.predict.fit.percept import config_text, percept, verdict_sentence
from analysis.predict.fit.percept_model import PAPER_RATES, PAPER_TRIALS
from analysis.predict.fit.percept_results import FittedPercept
from analysis.predict.fit.studies import (
    ASSUMED_SPREAD,
    Case,
    Judged,
    PerceptRequest,
    cases_of,
    judge,
    place_of,
    read_request,
)
from analysis.report.serial import plain
from device.methods import paper_methods
from experiments.config.door import ConfigError
from experiments.load import find, load_setup, shipped_folder
from experiments.synthetic.diffusion import People
from experiments.synthetic.laws import DiffusionLaw, SyntheticAnswers
from experiments.synthetic.percept import PerceptParameters
from tests.conftest import Recoil

METHODS = paper_methods()
PUBLISHED = load_paper(find("paper")).direction


@pytest.fixture(scope="module")
def cases() -> list[Case]:
    return cases_of(PAPER_RATES, METHODS, PAPER_TRIALS, PerceptParameters())


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("fit")


@pytest.fixture(scope="module")
def fitted(folder: Path) -> FittedPercept:
    """What the command made of the shipped paper."""
    return percept(PerceptRequest(studies=300), folder, silent)


@pytest.fixture
def found(fitted: FittedPercept) -> Any:
    """The same as its file has it."""
    return plain(fitted)


def silent(_: str, __: int) -> AbstractContextManager[Callable[[str], None]]:
    return nullcontext(lambda _: None)


def judged(case: Case, studies: int = 300, seed: int = 1) -> Judged:
    return judge(case, METHODS, PUBLISHED, studies=studies, seed=seed, tell=lambda _: None)[0]


def pasted(text: str, folder: Path) -> DiffusionLaw:
    """The law of the shipped people who feel the gun, with their own sections replaced by those of a fragment."""
    shutil.copytree(shipped_folder(), folder, dirs_exist_ok=True)
    design, people = folder / "direction.toml", folder / "synthetic" / "direction-felt.toml"
    design.write_text(design.read_text(encoding="utf-8").replace("direction.toml", "direction-felt.toml"))
    shipped = people.read_text(encoding="utf-8")
    for section in tomllib.loads(text)["questions"]["response"]:
        table = re.escape(f"[questions.response.{section}]")
        shipped, found = re.subn(rf"{table}.*?(?=\n\[|\Z)", "", shipped, flags=re.DOTALL)
        assert found == 1
    people.write_text(f"{shipped}\n{text}", encoding="utf-8")
    laws = load_setup(str(design)).laws
    assert isinstance(laws, SyntheticAnswers)
    law = laws.questions["response"]
    assert isinstance(law, DiffusionLaw)
    return law


# what it leaves


@pytest.mark.slow
def test_the_fit_to_the_shipped_paper_has_intervals_around_the_shipped_numbers(found: Any, folder: Path) -> None:
    for name, one in found["fitted"].items():
        assert one["ci_low"] < one["value"] < one["ci_high"]
        assert one["value"] == pytest.approx(getattr(PerceptParameters(), name), rel=5e-3)
    assert {name: one["observed"] for name, one in found["rates"].items()} == pytest.approx(PAPER_RATES)
    assert found["trials"] == PAPER_TRIALS
    assert json.loads((folder / "fit.json").read_text(encoding="utf-8")) == found


@pytest.mark.slow
def test_it_says_what_is_assumed_and_what_cannot_be_told(found: Any, folder: Path) -> None:
    assert found["assumed"] == {"exponent": 1.7, "leak_s": 0.02}
    assert found["untold"]["boundary"] == pytest.approx(1.0)
    page = (folder / "report.md").read_text(encoding="utf-8").replace("\N{NO-BREAK SPACE}", " ")
    for words in (
        "no response times from the participant's own hand, drift and boundary cannot be told apart",
        "A prediction, not a measurement",
        "no evidence for the model",
    ):
        assert words in page


@pytest.mark.slow
def test_the_same_rates_are_met_under_other_assumptions(found: Any) -> None:
    for one in found["other_assumptions"]:
        assert one["deviance"] == pytest.approx(0.0, abs=1e-6)
    assert len({round(one["sensitivity"], 3) for one in found["other_assumptions"]}) == len(found["other_assumptions"])


@pytest.mark.slow
def test_the_curve_over_friction_runs_through_the_fitted_points(found: Any) -> None:
    (curve,) = found["friction"]
    for name, friction in curve["methods"].items():
        rate = np.interp(friction, curve["friction_N"], curve["fit"]["value"])
        assert rate == pytest.approx(found["rates"][name]["observed"], abs=0.005)
    low, value, high = (np.array(curve["fit"][key]) for key in ("ci_low", "value", "ci_high"))
    assert ((low < value) & (value < high)).all()


@pytest.mark.slow
def test_a_backward_shot_is_the_forward_one_s_mirror_but_for_the_bias(found: Any) -> None:
    vibration = found["rates"]["vibration"]
    assert vibration["forward"]["value"] + vibration["backward"]["value"] == pytest.approx(1.0)
    for one in found["rates"].values():
        assert one["backward"]["value"] < one["forward"]["value"]


@pytest.mark.slow
def test_the_page_and_the_figures_are_there(found: Any, folder: Path) -> None:
    assert {path.stem for path in (folder / "figures").iterdir()} == {"percept", "places"}
    page = (folder / "report.md").read_text(encoding="utf-8").replace("\N{NO-BREAK SPACE}", " ")
    (told,) = re.findall(r"!\[Forward rate over friction\. fit: [^:]+: ([\d.]+) % at 0 N, ([\d.]+) % at 1\.4 N;", page)
    assert 70 < float(told[0]) < float(told[1]) < 100  # the curve rises, as the picture shows
    assert "data:image/png;base64," in (folder / "report.html").read_text(encoding="utf-8")


@pytest.mark.slow
def test_the_fragment_loads_back_through_the_config(found: Any, folder: Path, tmp_path: Path) -> None:
    law = pasted((folder / "percept.toml").read_text(encoding="utf-8"), tmp_path)
    for name, one in found["fitted"].items():
        assert getattr(law.percept.own, name) == pytest.approx(one["value"], rel=1e-5)
    assert law.people.own == People()


@pytest.mark.slow
def test_with_a_spread_the_fragment_brings_the_people_too(fitted: FittedPercept, tmp_path: Path) -> None:
    text = config_text(replace(fitted, people=ASSUMED_SPREAD))
    assert pasted(text, tmp_path).people.own == ASSUMED_SPREAD


@pytest.mark.slow
def test_the_command_without_a_name_fits_the_percept(recoil: Recoil, tmp_path: Path) -> None:
    rates = "vibration=0.5,asymmetric-1=0.7,asymmetric-2=0.9"
    done = recoil("fit", "--rates", rates, "--trials", "50", "--out", "out", "--json")
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert (found["trials"], found["fitted"]["start"]["value"]) == (50, pytest.approx(0.5, abs=1e-6))
    assert found["judged"] is None
    assert (tmp_path / "out" / "percept.toml").exists()


@pytest.mark.slow
@pytest.mark.parametrize(
    "rates",
    [(0.5, 1.0, 1.0), *(pytest.param(rates, marks=pytest.mark.soak) for rates in ((0.0,) * 3, (1.0, 0.1, 0.6)))],
)
def test_rates_at_the_ends_are_fitted_with_what_intervals_there_are(
    rates: tuple[float, float, float], tmp_path: Path
) -> None:
    text = ",".join(f"{name}={rate}" for name, rate in zip(METHODS, rates, strict=True))
    percept(PerceptRequest(rates=text, trials=20), tmp_path, silent)
    text = (tmp_path / "percept.toml").read_text(encoding="utf-8")
    assert pasted(text, tmp_path).percept.own.sensitivity >= 0.0


@pytest.mark.slow
def test_a_fit_too_unsure_to_draw_from_is_not_drawn_from() -> None:
    rates = {"vibration": 0.1, "asymmetric-1": 1.0, "asymmetric-2": 1.0}
    assert not any(case.drawn for case in cases_of(rates, METHODS, PAPER_TRIALS, PerceptParameters()))


# the judgement


@pytest.mark.slow
def test_the_studies_have_the_published_mean_rates_whoever_the_people_are(cases: list[Case]) -> None:
    """The fit is to those, so their counts lie around the published ones: the forward one is the middle."""
    for case in cases:
        (forward,) = (place for place in judged(case, 4000).places if place.fitted)
        assert forward.quantiles[2] == pytest.approx(0.205, abs=0.08), case.name


def test_the_backward_count_of_people_alike_is_binomial(cases: list[Case]) -> None:
    """By theory: 140 answers, right with the chance of the mirrored start."""
    found = {place.published[:2]: place for place in judged(cases[0], 4000).places if "correct of" in place.quantity}
    assert set(found) == {"67", "73"}
    for text, place in found.items():
        count = int(text)
        law = stats.binom(140, 1.0 - cases[0].fit.parameters.start)
        expected = law.cdf(count - 1) + 0.5 * law.pmf(count)
        assert place.percentile == pytest.approx(expected, abs=4 * np.sqrt(expected * (1 - expected) / 4000))
        assert place.ci_low < place.percentile < place.ci_high


@pytest.mark.slow
def test_percentiles_are_those_of_the_seed(cases: list[Case]) -> None:
    one, same, other = judged(cases[1]), judged(cases[1]), judged(cases[1], seed=2)
    assert (one.places, one.claims) == (same.places, same.claims)
    assert one.places != other.places


@pytest.mark.slow
def test_more_different_people_give_a_smaller_f(cases: list[Case]) -> None:
    medians = [judged(case, 3000).places[0].quantiles[2] for case in cases[:3]]
    assert medians[0] > medians[1] > medians[2]


@pytest.mark.slow
def test_the_error_of_the_fit_widens_the_places(cases: list[Case]) -> None:
    plain, drawn = (judged(case, 3000).places[0].quantiles for case in (cases[1], cases[3]))
    assert drawn[0] < plain[0]
    assert drawn[-1] > plain[-1]


def test_the_pattern_needs_every_pair(cases: list[Case]) -> None:
    shares = {claim.claim: claim.share for claim in judged(cases[1], 1000).claims}
    pairs = [share for name, share in shares.items() if " above " in name]
    assert len(pairs) == 3
    assert shares["whole pattern"] <= shares["Tukey, all pairs as published"] <= min(pairs)


def test_a_percentile_counts_those_below_and_half_of_those_that_print_alike() -> None:
    values = np.array([1.0, 2.0, 2.04, 3.0, np.inf, np.nan])
    place = place_of("F", ("2.0", 1.95, 2.05), values, False)
    assert place.percentile == pytest.approx((1 + 0.5 * 2) / 6)
    assert place.outside == pytest.approx(2 * place.percentile)


@pytest.mark.slow
def test_a_number_beyond_the_central_95_percent_is_called_at_odds(fitted: FittedPercept) -> None:
    assert fitted.judged is not None
    case = fitted.judged.main_case
    assert verdict_sentence(case).startswith("Every number that was not fitted lies within")
    odd = {"percentile": 0.005, "ci_low": 0.001, "ci_high": 0.02}
    far = replace(case, places=(replace(case.places[0], **odd), *case.places[1:]))
    places = tuple(replace(place, **odd) if place.published.startswith("73") else place for place in case.places)
    odd_count = replace(case, places=places)
    assert verdict_sentence(odd_count) == verdict_sentence(case)  # 67 gives the same printed p
    assert verdict_sentence(far).startswith(
        "At odds with the paper (outside the central 95 % of the studies): F(2, 26)"
    )


def test_five_studies_put_no_number_at_odds_with_the_paper(cases: list[Case]) -> None:
    """Wilson's interval of none of five reaches to 43 %."""
    case = judged(cases[1], 5)
    place = next(place for place in case.places if place.quantity.startswith("F(2, 26)"))
    lowest = replace(place, percentile=0.0, ci_low=0.0, ci_high=0.434, outside=0.0)
    words = verdict_sentence(replace(case, places=(lowest,)))
    assert words.startswith("Too few studies to tell whether these lie within their central 95 %: F(2, 26)")
    assert "whole pattern" in words


# refusals


@pytest.mark.parametrize(
    ("request_", "words"),
    [
        (PerceptRequest(rates="vibration=0.5,asymmetric-1=0.7"), "at least 3"),
        (PerceptRequest(rates="vibration=0.5,asymmetric-1=70,asymmetric-2=0.9"), "asymmetric-1=70"),
        (PerceptRequest(rates="vibration=0.5,vibration=0.7,asymmetric-2=0.9"), "vibration stands there twice"),
        (PerceptRequest(rates="vibration=0.5,ramp=0.7,asymmetric-2=0.9"), "no such method"),
        (PerceptRequest(trials=20), "--trials 20"),
        (
            PerceptRequest(rates="vibration=0.5,asymmetric-1=0.7,asymmetric-2=0.9", studies=10),
            "--studies 10: with --rates",
        ),
        (PerceptRequest(spread=-1.0), "--spread -1"),
        (PerceptRequest(paper="nowhere"), "nowhere"),
        (PerceptRequest(gun="paper"), "paper.toml"),
    ],
)
def test_what_cannot_be_fitted_is_refused_in_words(request_: PerceptRequest, words: str) -> None:
    with pytest.raises(ConfigError, match=re.escape(words)):
        read_request(request_)


def test_a_paper_of_which_a_mean_is_missing_is_refused(tmp_path: Path) -> None:
    text = find("paper").read_text(encoding="utf-8")
    path = tmp_path / "paper.toml"
    path.write_text(text.replace('vibration = "55.7"\n', "", 1), encoding="utf-8")
    with pytest.raises(ConfigError, match="has no rate of vibration"):
        read_request(PerceptRequest(paper=str(path)))


@pytest.mark.slow
def test_one_study_is_judged_too_and_a_place_that_cannot_be_is_said_before_the_work(
    recoil: Recoil, tmp_path: Path
) -> None:
    done = recoil("fit", "percept", "--studies", "1", "--out", "one")
    assert (done.returncode, (tmp_path / "one" / "report.html").exists()) == (0, True), done.stderr
    (tmp_path / "afile").write_text("")
    refused = recoil("fit", "percept", "--studies", "1", "--out", "afile")
    assert (refused.returncode, "percept" in refused.stdout) == (2, False)
    assert "afile: Not a directory" in refused.stderr
