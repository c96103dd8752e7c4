"""Images in files: their order, and the times in their names."""

import cv2
import numpy as np
import pytest

from zfcal.cameras.sequence import ImageSequence, images_of, time_in
from zfcal.errors import InputError

FPS = 15.0


@pytest.fixture
def put(tmp_path):
    """Return what writes images of these names; the k-th is grey k."""

    def write(*names):
        for k, name in enumerate(names):
            assert cv2.imwrite(str(tmp_path / name), np.full((8, 6, 3), k, np.uint8))
        return tmp_path

    return write


def read(folder):
    """Return times and greys of a folder's images, and the source."""
    source = ImageSequence(str(folder), images_of(str(folder)), fps=FPS)
    found = list(source.shots())
    return [s.time_s for s in found], [int(s.image[0, 0, 0]) for s in found], source


def test_numbers_in_names_count_as_numbers(put):
    """frame2 comes before frame10."""
    times, greys, source = read(put("frame2.png", "frame10.png", "frame1.png"))
    assert greys == [2, 0, 1]
    np.testing.assert_allclose(times, [0, 1 / 15, 2 / 15])
    assert "the names of the images hold no times" in source.notes[0]


def test_times_in_names_are_the_stamps(put):
    """From the first one on, gaps and all."""
    names = [f"cam_1700000000.{ms:03d}.png" for ms in (0, 67, 133, 400)]
    times, _, source = read(put(*names))
    np.testing.assert_allclose(times, [0, 0.067, 0.133, 0.4], atol=1e-6)
    assert source.notes == []


@pytest.mark.parametrize(
    ("name", "time_s"),
    [
        ("overhead_1700000000.250", 1700000000.25),
        ("1700000000250", 1700000000.25),
        ("1700000000250000000", 1700000000.25),
        ("2026-11-21T10-00-00.5", 1795255200.5),
        ("20261121_100000_500", 1795255200.5),
        ("frame_000123", None),
        ("day3-0001", None),
        ("20261341_100000", None),
    ],
)
def test_a_name_tells_its_time_or_none(name, time_s):
    """Seconds since 1970, with or without a point, or a date; a counter is no time."""
    assert time_in(name) == time_s


def test_a_name_without_time_among_those_with_one_is_refused(put):
    """It is named."""
    folder = put("1700000000.0.png", "1700000000.1.png", "background.png")
    with pytest.raises(InputError, match=r"background.png: its name holds no time, those of 2"):
        read(folder)


def test_an_image_that_cannot_be_read_is_left_out(put):
    """Its place in time stays empty, and it is named."""
    folder = put("0.png", "1.png", "2.png")
    (folder / "1.png").write_bytes(b"\x89PNG\r\n\x1a\n cut")
    times, greys, source = read(folder)
    assert greys == [0, 2]
    np.testing.assert_allclose(times, [0, 2 / 15])
    assert "1.png: cannot be read as an image" in source.problems[0].says


def test_a_pattern_takes_what_answers_to_it(put):
    """In order; nothing answering is an error, and so is something else than an image."""
    folder = put("a1.png", "a2.png", "b1.png")
    (folder / "notes.txt").write_text("x")
    assert [path.name for path in images_of(f"{folder}/a*.png")] == ["a1.png", "a2.png"]
    with pytest.raises(InputError, match="no file answers"):
        images_of(f"{folder}/c*.png")
    with pytest.raises(InputError, match=r"notes.txt: is no image"):
        images_of(f"{folder}/*")


def test_a_folder_or_file_that_holds_no_images_is_no_sequence(tmp_path):
    """It may be a video."""
    assert images_of(str(tmp_path)) is None
    (tmp_path / "x[1].mp4").write_bytes(b"")
    assert images_of(str(tmp_path / "x[1].mp4")) is None
