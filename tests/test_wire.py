"""The wire's bytes and words: whatever comes, it is a word or a `LinkError`, soon, and in little memory."""

import tracemalloc
import zlib
from contextlib import suppress

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from device import LinkError
from device.wire import records
from device.wire.errors import WireError, message
from device.wire.records import (
    LAST_NUMBER,
    MAX_BODY,
    MAX_LINE,
    Frame,
    Garbled,
    Named,
    Setting,
    ShotRecord,
    Splitter,
    StatusRecord,
    decode,
    encode,
    following,
    is_newer,
    refusal_in,
)

BODIES = st.text(st.characters(min_codepoint=0x20, max_codepoint=0x7E), min_size=1, max_size=MAX_BODY)
FRAMES = st.builds(Frame, number=st.integers(1, LAST_NUMBER), body=BODIES)
SENDERS = st.sampled_from(["host", "gun"])
NUMBERS = st.integers(0, 10**16 - 1)
SHORT_NUMBERS = st.integers(0, 2**32 - 1)
NAMES = st.from_regex(r"[A-Za-z0-9._-]{1,24}", fullmatch=True)
NAMED = st.builds(Named, model=NAMES, serial=NAMES, wire=st.integers(0, 9999), firmware=NAMES)
SETTINGS = st.builds(
    Setting,
    method=st.from_regex(r"[a-z0-9-]{1,24}", fullmatch=True),
    way=st.sampled_from(["FORW", "BACK"]),
    kind=st.sampled_from(["PULS", "EFF"]),
    **dict.fromkeys(("amount", "length_us", "rest_us"), SHORT_NUMBERS),
)
SHOTS = st.builds(
    ShotRecord,
    count=SHORT_NUMBERS,
    mark=SHORT_NUMBERS,
    ending=st.sampled_from(["NONE", "WAIT", "DRIV", "DONE", "CUT"]),
    accepted_us=NUMBERS,
    start_us=NUMBERS,
    end_us=NUMBERS,
    home_predicted_us=NUMBERS,
    setting=SETTINGS,
)
STANDINGS = st.builds(
    StatusRecord,
    state=st.sampled_from(["DISARMED", "ARMED", "RESETTING", "WAITING", "FIRING", "FAULT"]),
    **dict.fromkeys(("count", "clock_us", "ready_us", "coil_mC", "fault"), NUMBERS),
)
READERS = (
    Named.parse,
    Setting.parse,
    ShotRecord.parse,
    StatusRecord.parse,
    records.whole_number,
    lambda text: records.named_value(text, "TIME"),
    refusal_in,
)


@given(FRAMES, SENDERS)
def test_a_frame_comes_back_from_its_line(frame, sender):
    line = encode(frame, sender)
    assert len(line) <= MAX_LINE + 1
    assert decode(line.removesuffix(b"\n"), sender) == frame


@given(FRAMES, st.data())
def test_a_frame_with_one_byte_changed_lost_or_doubled_is_garbled(frame, data):
    line = encode(frame, "host").removesuffix(b"\n")
    place = data.draw(st.integers(0, len(line) - 1))
    bit = data.draw(st.integers(0, 7))
    changed = line[:place] + bytes([line[place] ^ 1 << bit]) + line[place + 1 :]
    doubled = line[: place + 1] + line[place:]
    for damaged in (changed, line[:place] + line[place + 1 :], doubled):
        with pytest.raises(Garbled):
            decode(damaged, "host")


def test_the_hosts_own_echo_is_no_answer():
    with pytest.raises(Garbled):
        decode(encode(Frame(number=1, body="ARM"), "host").strip(), "gun")


def test_the_number_0000_is_the_guns_alone():
    frame = Frame(number=0, body="NAK")
    assert decode(encode(frame, "gun").strip(), "gun") == frame
    with pytest.raises(Garbled, match="0001 to FFFF"):
        decode(encode(frame, "host").strip(), "host")


def test_the_checksum_is_that_of_zip_files():
    assert zlib.crc32(b"123456789") == 0xCBF43926  # the check value of CRC-32/ISO-HDLC in the RevEng catalogue
    assert encode(Frame(number=1, body="TIME?"), "host").endswith(b"~%08X\n" % zlib.crc32(b">0001 TIME?"))


@pytest.mark.parametrize(("number", "body"), [(-1, "A"), (65536, "A"), (1, ""), (1, "A\n"), (1, "é"), (1, "A" * 186)])
def test_a_frame_that_cannot_be_written_cannot_be_built(number, body):
    with pytest.raises(ValueError, match=r"number is|body is"):
        Frame(number=number, body=body)


@pytest.mark.slow
@settings(max_examples=500)
@given(st.binary(max_size=2 * MAX_LINE), SENDERS)
@example(b">0001 A~", "host")
def test_any_line_is_a_frame_or_a_link_error(line, sender):
    try:
        frame = decode(line, sender)
    except LinkError:
        return
    assert encode(frame, sender) == line + b"\n"


@pytest.mark.slow
@settings(max_examples=300)
@given(st.text(max_size=300) | BODIES)
@example("٣")
@example("SHOT 1,1,DONE,1,1,1,1,a,FORW,PULS,1,1,²")
def test_any_text_is_a_record_or_a_link_error(text):
    for read in READERS:
        with suppress(LinkError):
            read(text)


@pytest.mark.slow
@given(NAMED | SETTINGS | SHOTS | STANDINGS)
def test_a_record_comes_back_from_its_text_and_fits_a_frame(record):
    assert type(record).parse(record.text()) == record
    Frame(number=1, body=record.text())


@pytest.mark.parametrize("code", WireError)
def test_every_error_is_read_back_as_a_refusal(code):
    assert refusal_in(f"ERR {message(code)}") == (code, code.text)


@given(st.binary(max_size=3000), st.lists(st.integers(0, 3000), max_size=10))
def test_lines_do_not_depend_on_how_the_bytes_come_in(data, cuts):
    whole, pieces, last = Splitter().feed(data), [], 0
    splitter = Splitter()
    for cut in [*sorted(cuts), len(data)]:
        pieces += splitter.feed(data[last:cut])
        last = max(last, cut)
    assert pieces == whole
    assert all(line is None or (0 < len(line) <= MAX_LINE and b"\n" not in line) for line in whole)


@pytest.mark.parametrize(("length", "end"), [(MAX_LINE, b"\n"), (MAX_LINE, b"\r\n"), (1, b"\n")])
def test_the_longest_line_is_taken_and_a_longer_one_left_out(length, end):
    assert Splitter().feed(b"a" * length + end) == [b"a" * length]
    assert Splitter().feed(b"a" * (MAX_LINE + 1) + end + b"b\n") == [None, b"b"]


def test_a_flood_without_an_end_takes_little_memory():
    splitter, chunk = Splitter(), b"\xff" * 65536
    tracemalloc.start()
    for _ in range(1000):  # 65 MB
        assert splitter.feed(chunk) == []
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 500_000
    assert splitter.feed(b"\nARM\n") == [None, b"ARM"]


@given(st.integers(1, LAST_NUMBER))
def test_numbers_go_round_and_the_older_half_is_not_newer(number):
    ahead = number
    for _ in range(3):
        ahead = following(ahead)
        assert is_newer(ahead, number)
        assert not is_newer(number, ahead)
    assert not is_newer(number, number)
