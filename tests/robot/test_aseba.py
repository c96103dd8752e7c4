"""Frames of the Aseba network, byte by byte."""

import itertools

import pytest
from hypothesis import given
from hypothesis import strategies as st

from zfcal.errors import InputError
from zfcal.robot.aseba import LONGEST_PAYLOAD, Decoder, Frame

WORDS = st.integers(0, 2**16 - 1)
FRAMES = st.builds(Frame, type=WORDS, source=WORDS, payload=st.binary(max_size=LONGEST_PAYLOAD))


def test_a_frame_is_three_words_and_its_payload():
    """Little-endian: length 4, source 0, type 11, then two words."""
    frame = Frame(type=11, payload=bytes([10, 0, 12, 0]))
    assert frame.encode() == bytes.fromhex("04 00 00 00 0b 00 0a 00 0c 00")
    assert frame.arguments == (10, 12)


def test_arguments_are_signed_and_an_odd_byte_is_left_out():
    """-45 is d3 ff; what is half a word says nothing."""
    assert Frame(type=21, payload=bytes([0xD3, 0xFF, 7])).arguments == (-45,)


@given(st.lists(FRAMES, max_size=6))
def test_what_was_encoded_is_decoded(frames):
    """Any frames, one behind the other, in one piece."""
    decoder = Decoder()
    assert decoder.feed(b"".join(frame.encode() for frame in frames)) == frames
    assert decoder.n_dropped == 0


@given(st.lists(FRAMES, max_size=4), st.data())
def test_splitting_the_bytes_changes_nothing(frames, data):
    """However many bytes a read gives, the same frames come in the same order."""
    line = b"".join(frame.encode() for frame in frames)
    cuts = sorted(data.draw(st.lists(st.integers(0, len(line)), max_size=12)))
    parts = [line[a:b] for a, b in itertools.pairwise([0, *cuts, len(line)])]
    decoder = Decoder()
    assert [frame for part in parts for frame in decoder.feed(part)] == frames


@given(st.binary(max_size=2000))
def test_garbage_is_survived(noise):
    """Any bytes at all: no error, and every byte is in a frame, dropped, or waits."""
    decoder = Decoder()
    frames = decoder.feed(noise)
    used = sum(6 + len(frame.payload) for frame in frames)
    assert 0 <= len(noise) - used - decoder.n_dropped < 6 + LONGEST_PAYLOAD


def test_an_impossible_length_is_skipped_to_the_next_frame():
    """Noise of ff before a frame of four bytes costs those bytes and not the frame."""
    frame = Frame(type=11, payload=bytes([10, 0, 12, 0]))
    decoder = Decoder()
    assert decoder.feed(b"\xff" * 9 + frame.encode()) == [frame]
    assert decoder.n_dropped == 9


def test_a_new_connection_forgets_what_had_begun():
    """Half a frame and then a whole one over another connection: the whole one is read."""
    frame = Frame(type=5, payload=b"\x05\x00", source=35)
    decoder = Decoder()
    assert decoder.feed(frame.encode()[:5]) == []
    decoder.reset()
    assert decoder.feed(frame.encode()) == [frame]


@pytest.mark.parametrize(
    "wrong",
    [
        {"type": -1},
        {"type": 2**16},
        {"type": 1, "source": 70000},
        {"type": 1, "payload": b"x" * 517},
    ],
)
def test_what_fits_no_frame_is_refused(wrong):
    """Words of 16 bits, 516 bytes at most."""
    with pytest.raises(InputError):
        Frame(**wrong)
