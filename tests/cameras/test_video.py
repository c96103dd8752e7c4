"""Video files give their images with the time stamps that they hold."""

import itertools

import cv2
import numpy as np
import pytest

from zfcal.cameras.live import LiveCamera
from zfcal.cameras.sequence import ImageSequence
from zfcal.cameras.video import VideoFile, decoded, encoded, is_live, open_source
from zfcal.errors import DamagedError, InputError

FPS = 15.0
N = 40


@pytest.fixture
def images():
    """Return 40 images of noise, which no compression makes small."""
    rng = np.random.default_rng(1)
    return [rng.integers(0, 255, (48, 64, 3), dtype=np.uint8) for _ in range(N)]


@pytest.fixture
def video(tmp_path, images):
    """Return what writes them as a video without loss, by its name."""

    def write(name="x.avi", code="FFV1"):
        path = tmp_path / name
        writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*code), FPS, (64, 48))
        assert writer.isOpened()
        for image in images:
            writer.write(image)
        writer.release()
        return path

    return write


@pytest.mark.parametrize("name", ["x.avi", "x.mkv"])
def test_every_image_comes_with_its_stamp(video, images, name):
    """Bit by bit, a fifteenth of a second apart; Matroska rounds to milliseconds."""
    source = VideoFile(video(name))
    found = list(source.shots())
    assert all(np.array_equal(s.image, image) for s, image in zip(found, images, strict=True))
    times = np.array([shot.time_s for shot in found])
    np.testing.assert_allclose(times, np.arange(N) / FPS, atol=0.0006)
    assert (source.rate_hz, source.problems, source.notes) == (FPS, [], [])
    assert source.length_s == pytest.approx(N / FPS)


def test_it_can_be_read_twice(video):
    """Each time from the start."""
    source = VideoFile(video())
    first, second = (next(iter(source.shots())) for _ in range(2))
    assert np.array_equal(first.image, second.image)


def test_uneven_stamps_stay_uneven(tmp_path, video):
    """A frame that was never written leaves a hole in the times, not a shift."""
    # Matroska blocks carry a stamp each: one block is cut out of the file.
    path = video("x.mkv")
    whole = VideoFile(path)
    times = [round(1000 * shot.time_s) for shot in whole.shots()]
    stamps = [b - a for a, b in itertools.pairwise(times)]
    assert set(stamps) <= {66, 67}
    content = path.read_bytes()
    place, size = _block(content, 20)
    path.write_bytes(content[:place] + _void(size) + content[place + size :])
    cut = [round(1000 * shot.time_s) for shot in VideoFile(path).shots()]
    assert cut == times[:20] + times[21:]


def _block(content, number):
    """Return place and size of a simple block of a Matroska file, head and all."""
    place = 0
    for _ in range(number + 1):
        place = content.index(b"\xa3", place + 1)
        while not _is_block(content, place):
            place = content.index(b"\xa3", place + 1)
    return place, _is_block(content, place)


def _is_block(content, place):
    """Return the size of the element if it is a block of track 1 that FFV1 could fill, or 0."""
    head = content[place + 1]
    length = 8 - head.bit_length() + 1
    if length > 4 or head == 0:
        return 0
    size = int.from_bytes(content[place + 1 : place + 1 + length]) & ((1 << (7 * length)) - 1)
    is_first_track = content[place + 1 + length : place + 2 + length] == b"\x81"
    return 1 + length + size if is_first_track and 5000 < size < 20000 else 0


def _void(size):
    """Return an element of that size which players pass over, its size written in eight bytes."""
    return b"\xec" + (1 << 56 | (size - 9)).to_bytes(8) + bytes(size - 9)


def test_a_video_that_was_cut_short_says_how_much_is_left(video):
    """What can be read is given, and then the problem stands there."""
    path = video()
    content = path.read_bytes()
    path.write_bytes(content[: len(content) * 6 // 10])
    source = VideoFile(path)
    found = list(source.shots())
    assert 10 < len(found) < 30
    (problem,) = source.problems
    assert problem.says == (
        f"{path}: was cut short or is damaged: {len(found)} of {N} frames can be read."
    )


@pytest.mark.parametrize(
    ("content", "says"), [(b"", "empty"), (b"no video at all" * 99, "no video that can be opened")]
)
def test_what_is_no_video_is_named(tmp_path, content, says):
    """In one line, with what to do."""
    path = tmp_path / "x.mp4"
    path.write_bytes(content)
    with pytest.raises(DamagedError, match=says) as error:
        open_source(str(path), fps=FPS)
    assert "Copy it again" in error.value.hint


def test_a_missing_file_is_an_input_error(tmp_path):
    """With what could be given."""
    with pytest.raises(InputError, match="no such file"):
        open_source(str(tmp_path / "x.mp4"), fps=FPS)
    with pytest.raises(InputError, match="folder without images"):
        open_source(str(tmp_path), fps=FPS)


@pytest.mark.parametrize(
    "text", ["0", "12", "/dev/video0", "http://h/cam.mjpg", "rtsp://10.0.0.1:8554/over"]
)
def test_a_number_a_device_or_an_address_is_a_live_camera(text):
    """Opened when images are asked for."""
    assert is_live(text)
    assert isinstance(open_source(text, fps=FPS), LiveCamera)


@pytest.mark.parametrize("text", ["x.mp4", "day 3/x.avi", "images", "/dev/videos", "0.mp4"])
def test_a_path_is_no_live_camera(text):
    """Whatever it looks like."""
    assert not is_live(text)


def test_a_folder_of_images_is_a_sequence(tmp_path, images):
    """Though it holds other files too."""
    cv2.imwrite(str(tmp_path / "0.png"), images[0])
    (tmp_path / "notes.txt").write_text("of Tuesday")
    assert isinstance(open_source(str(tmp_path), fps=FPS), ImageSequence)


def test_png_loses_nothing_and_jpeg_little(images):
    """And what is no image decodes to none."""
    smooth = cv2.GaussianBlur(images[0], (0, 0), 4)
    assert np.array_equal(decoded(encoded(smooth, "png")), smooth)
    jpeg = decoded(encoded(smooth, "jpeg"))
    assert 0 < np.abs(jpeg.astype(int) - smooth).mean() < 2
    assert decoded(b"\x89PNG\r\n\x1a\n nothing more") is None
