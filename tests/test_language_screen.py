"""The participant's real window in a language from right to left, worked by real keys, and how its lines are made."""

import pytest

from experiments.screens.participant import lettering
from tests.at_participant import display, hands, pytestmark
from tests.pseudo_languages import RIGHT_TO_LEFT, write_pseudo_languages
from tests.shown_languages import HEIGHT, WIDTH, opened_in
from tests.waiting import PATIENCE_S

__all__ = ["display", "hands", "pytestmark"]
INK = 120
"""So light are letters on the dark ground, and nothing else."""


@pytest.fixture(scope="module")
def turned(display, tmp_path_factory):
    with opened_in(RIGHT_TO_LEFT, write_pseudo_languages(tmp_path_factory.mktemp("own")), display) as pages:
        yield pages


def lit(image, left, top, right, bottom):
    """How many pixels of letters there are in a part of a picture."""
    box = tuple(round(part * size) for part, size in zip((left, top, right, bottom), (WIDTH, HEIGHT) * 2, strict=True))
    return sum(image.crop(box).convert("L").histogram()[INK:])


def test_what_is_typed_from_right_to_left_begins_at_the_right_and_is_kept_as_it_was_typed(turned, hands):
    answer = turned.asked(turned.questions["description"])
    empty = turned.picture()
    hands.changing(lambda: [hands.key(name) for name in ("a", "b", "Return", "c")])
    written = turned.picture()
    assert lit(written, 0.6, 0.35, 0.97, 0.5) > lit(empty, 0.6, 0.35, 0.97, 0.5)
    assert lit(written, 0.05, 0.35, 0.4, 0.5) == lit(empty, 0.05, 0.35, 0.4, 0.5)
    hands.key("Return", "Control_L")
    assert answer.result(PATIENCE_S).comment == "ab\nc"


def test_a_scale_keeps_its_sides_from_right_to_left(turned, hands):
    answer = turned.asked(turned.questions["rating"])
    hands.key("Home")
    hands.key("Right")
    hands.key("Return")
    assert answer.result(PATIENCE_S).rating == pytest.approx(0.1)


def test_an_answer_keeps_its_side_and_its_key(turned, hands):
    answer = turned.asked(turned.questions["choice"])
    hands.key("Left")
    assert answer.result(PATIENCE_S).response == "forward"


def test_lines_from_right_to_left_come_in_their_order():
    lines = lettering.laid_out("one two three four", 9.1, len, lambda line: line[::-1]).split("\n")
    assert lines == ["owt eno", "eerht", "ruof"]


@pytest.mark.parametrize("width", [3.1, 5.1, 8.1, 100])
def test_nothing_is_lost_between_lines_and_none_begins_with_a_full_stop(width):
    text = "在虚拟现实第一人称射击游戏中，您有多喜欢？这种 haptic 反馈（触觉）。"
    lines = lettering.laid_out(text, width, len, None).split("\n")
    assert "".join(lines).replace(" ", "") == text.replace(" ", "")
    assert not [line for line in lines if line[0] in "，。？）"]
    assert max(map(len, lines)) <= max(width, len("haptic"), 3)
