from __future__ import annotations

from pathlib import Path

import pytest

from analysis.paper.paper import load_paper
from experiments.config.door import ConfigError

SHIPPED = Path(__file__).parent.parent / "configs" / "paper.toml"


def test_the_shipped_paper_holds_the_published_numbers_as_printed() -> None:
    paper = load_paper(SHIPPED)
    assert paper.direction.means == {"vibration": "55.7", "asymmetric-1": "79.3", "asymmetric-2": "92.9"}
    assert (paper.direction.anova.F, paper.preference.anova.F) == ("28.45", "33.810")
    assert [claim.p for claim in paper.direction.binomial] == ["0.205", "0.673"]
    assert (paper.preference.lowest.participants, paper.preference.same_score.participants) == (14, 2)


def test_the_shipped_protocol_adds_up() -> None:
    paper = load_paper(SHIPPED)
    protocol = paper.direction.protocol
    trials = protocol.sets_per_session * protocol.trials_per_set
    assert protocol.forward_trials_per_session + protocol.backward_trials_per_session == trials == 20
    for published in (paper.direction, paper.preference):
        k = len(published.methods)
        assert published.anova.df == [k - 1, (published.n - 1) * (k - 1)]
    assert paper.participants.female + paper.participants.male == paper.participants.n


def test_the_shipped_paper_also_carries_the_claims_for_the_audit() -> None:
    paper = load_paper(SHIPPED)
    assert paper.paper.title.startswith("Design and Modeling of an Ungrounded Haptic Gun")
    assert len(paper.claims) > 30
    assert all({"place", "quote", "kind"} <= set(claim) for claim in paper.claims)


def test_a_paper_without_claims_and_head_is_read_as_before(tmp_path: Path) -> None:
    text = SHIPPED.read_text(encoding="utf-8").partition("# Everything else")[0]
    path = tmp_path / "paper.toml"
    path.write_text(text[: text.index("[paper]")] + text[text.index("[participants]") :], encoding="utf-8")
    assert load_paper(path).claims == []


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('F = "28.45"', "F = 28.45", ["direction.anova.F", "28.45", "must be text"]),
        ('F = "28.45"', 'F = "28,45"', ["direction.anova.F", "'28,45'", "digits as they are printed"]),
        ('F = "28.45"', 'F = "28.45"\nG = 1', ["direction.anova.G", "1", "unknown key"]),
        ('F = "28.45"\n', "", ["direction.anova.F", "missing"]),
        ('p = "0.205"', 'p = "20.5"', ["direction.binomial.0.p", "'20.5'", "above 1"]),
        ('direction = "forward"', 'direction = "left"', ["direction.binomial.0.direction", "'left'", "forward"]),
        ('higher = "asymmetric-1"', 'higher = "ramp"', ["direction", "ramp above vibration", "two of"]),
        ("[participants]\nn = 14", "[participants]\nn = 0", ["participants.n", "0", "must be at least 1"]),
        ("[participants]", "[participants", ["paper.toml:12: not TOML"]),
    ],
)
def test_bad_input_is_one_message_with_file_key_value_and_rule(
    old: str, new: str, words: list[str], tmp_path: Path
) -> None:
    path = tmp_path / "paper.toml"
    path.write_text(SHIPPED.read_text(encoding="utf-8").replace(old, new, 1), encoding="utf-8")
    with pytest.raises(ConfigError, match=r"paper\.toml:(\d+:)? ") as caught:
        load_paper(path)
    message = str(caught.value)
    assert [word for word in words if word not in message] == [], message
    assert "\n" not in message


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"nowhere\.toml: cannot be read"):
        load_paper(tmp_path / "nowhere.toml")
