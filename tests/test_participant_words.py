import json
import threading
from io import BytesIO

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from experiments.clock import ClockMap, RoundTrip, clock_map
from experiments.screens.participant.app import Wire
from experiments.screens.participant.messages import (
    AskChoice,
    AskDescription,
    AskRating,
    ChoiceGiven,
    CloseScreen,
    DescriptionGiven,
    KeyedAnswer,
    Look,
    Noise,
    NoiseIs,
    Ping,
    Pong,
    RatingGiven,
    Ready,
    ScreenFailed,
    Show,
    arguments,
    from_participant_from,
    line,
    look_from,
    to_participant_from,
)
from experiments.screens.participant.pages import move, put

TEXT = st.text()
NUMBER = st.floats(allow_nan=False, allow_infinity=False)
COUNT = st.integers(0, 10_000)
SHARE = st.floats(0, 1)

TO = st.one_of(
    st.builds(Show, text=TEXT, tell=st.tuples(TEXT), keep_keys=st.booleans()),
    st.builds(
        AskRating,
        number=COUNT,
        of=COUNT,
        question=TEXT,
        minimum=NUMBER,
        maximum=NUMBER,
        minimum_text=TEXT,
        maximum_text=TEXT,
        grain=st.floats(1e-6, 10),
        ask=COUNT,
    ),
    st.builds(AskDescription, number=COUNT, of=COUNT, question=TEXT, ask=COUNT),
    st.builds(
        AskChoice,
        question=TEXT,
        answers=st.lists(st.builds(KeyedAnswer, answer=TEXT, label=TEXT, key=TEXT)).map(tuple),
        onset_s=NUMBER,
        ask=COUNT,
    ),
    st.builds(Ping, sent_s=NUMBER),
    st.builds(Noise, on=st.booleans(), level=SHARE, ask=COUNT),
    st.just(CloseScreen()),
)
FROM = st.one_of(
    st.builds(Ready, psychopy=TEXT, window=TEXT, refresh_Hz=st.none() | NUMBER),
    st.builds(Pong, sent_s=NUMBER, there_s=NUMBER),
    st.builds(RatingGiven, rating=NUMBER, ask=COUNT),
    st.builds(DescriptionGiven, comment=TEXT, ask=COUNT),
    st.builds(ChoiceGiven, response=TEXT, pressed_s=NUMBER, ask=COUNT),
    st.builds(NoiseIs, on=st.booleans(), message=TEXT, ask=COUNT),
    st.builds(ScreenFailed, message=TEXT),
)
SCALE = AskRating(
    number=1, of=3, question="?", minimum=0, maximum=10, minimum_text="low", maximum_text="high", grain=0.1
)


@given(TO)
def test_every_word_to_the_participant_comes_back_from_its_line_whatever_its_texts_hold(word):
    wire = line(word)
    assert wire.count(b"\n") == 1
    assert wire.endswith(b"\n")
    assert to_participant_from(wire) == word


@pytest.mark.slow
@given(FROM)
def test_every_word_from_the_participant_comes_back_from_its_line_whatever_its_texts_hold(word):
    assert from_participant_from(line(word)) == word


def test_quotes_newlines_and_chinese_keep_to_one_line_of_ascii():
    wire = line(DescriptionGiven(comment='he said "hm",\nthen 很好\u2028\r'))
    assert wire.isascii()
    assert wire.count(b"\n") == 1
    assert from_participant_from(wire) == DescriptionGiven(comment='he said "hm",\nthen 很好\u2028\r')


GARBAGE = [
    b"",
    b"\n",
    b"ALSA lib: no such device\n",
    b"[]",
    b"{}",
    b'{"kind": "rating"}',
    b'{"kind": "rating-given", "rating": NaN}',
    b'{"kind": "rating-given", "rating": 1e999}',
    b'{"kind": "rating-given", "rating": null}',
    b'{"kind": "description-given", "comment": null}',
    b'{"kind": "choice-given", "response": 1, "pressed_s": 1}',
    b'{"kind": "failed", "message": "half',
    b"\xff\xfe",
]


@pytest.mark.parametrize("wire", GARBAGE)
def test_garbage_is_no_word(wire):
    with pytest.raises(ValidationError):
        from_participant_from(wire)


@given(st.binary())
def test_bytes_are_a_word_or_refused_and_nothing_else(wire):
    try:
        word = from_participant_from(wire)
    except ValidationError:
        return
    assert json.loads(line(word))["kind"] == word.kind


def test_what_one_side_says_is_no_word_of_the_other():
    with pytest.raises(ValidationError):
        to_participant_from(line(ScreenFailed(message="no")))


def test_a_question_with_a_number_that_is_none_is_not_sent():
    with pytest.raises(ValueError, match="not JSON compliant"):
        line(Ping(sent_s=float("nan")))


def test_a_marker_that_stands_nowhere_goes_to_the_middle_with_the_first_arrow_and_then_in_grains():
    assert move(SCALE, None, "left") == 5.0
    assert move(SCALE, 5.0, "left") == 4.9
    assert move(SCALE, 5.0, "far right") == 6.0


def test_a_marker_stays_on_the_scale():
    assert move(SCALE, 0.0, "left") == 0.0
    assert move(SCALE, None, "last") == 10.0
    assert move(SCALE, None, "first") == 0.0
    assert put(SCALE, -0.3) == 0.0
    assert put(SCALE, 1.3) == 10.0
    assert put(SCALE, 0.7349) == 7.3


@pytest.mark.slow
@given(
    offset_s=st.floats(-1e6, 1e6),
    trips=st.lists(st.tuples(st.floats(0, 1), st.floats(0, 1)), min_size=1, max_size=10),
)
def test_the_true_offset_of_the_clocks_is_within_the_uncertainty(offset_s, trips):
    made = [
        RoundTrip(sent_s=float(n), there_s=n + there + offset_s, back_s=n + there + back)
        for n, (there, back) in enumerate(trips)
    ]
    found = clock_map(made)
    assert abs(found.offset_s - offset_s) <= found.uncertainty_s + 1e-9


def test_a_moment_goes_to_the_other_clock_and_back():
    clocks = ClockMap(offset_s=100.0, uncertainty_s=0.001)
    assert clocks.there(1.5) == 101.5
    assert clocks.here(101.5) == 1.5


@pytest.mark.parametrize(
    "look",
    [Look(), Look(screen=1, theme="light", font="DejaVu Sans"), Look(full_screen=False, width_px=1024, height_px=768)],
)
def test_a_look_is_what_its_arguments_say(look):
    assert look_from(arguments(look)) == look


RATE = AskRating(
    number=1, of=2, question="?", minimum=0.0, maximum=1.0, minimum_text="", maximum_text="", grain=1.0, ask=1
)
CHOOSE = AskChoice(question="?", answers=(KeyedAnswer(answer="a", label="a", key="left"),), onset_s=0.0, ask=2)


def heard(*words):
    """What a participant's program makes of words that were all there before it looked."""
    wire = Wire(BytesIO(b"".join(map(line, words))), BytesIO(), lambda: 0.0)
    wire.listen()
    for listening in [one for one in threading.enumerate() if one.name == "console's words"]:
        listening.join()
    return [*iter(wire.word, None)]


def test_a_question_to_type_on_that_is_called_off_already_takes_nobody_the_keys():
    wait, words = Show(text="Wait."), AskDescription(number=1, of=2, question="?", ask=3)
    assert heard(RATE, wait, words, RATE, CHOOSE, wait) == [wait, CHOOSE, wait, CloseScreen()]
    assert heard(wait, words, RATE) == [wait, CloseScreen()]
