"""Camera images in MCAP files."""

import cv2
import numpy as np
import pytest
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer
from mcap_protobuf.decoder import DecoderFactory

from zfcal.artifacts.frame_files import (
    FRAMES,
    Calibration,
    FrameWriter,
    frame_segments,
    read_frames,
)
from zfcal.artifacts.lineage import Lineage, read_lineage
from zfcal.artifacts.mcap_files import Overview, overview
from zfcal.errors import DamagedError, InputError, StorageError

FPS = 15.0

KNOWN = Calibration(
    size_px=(8, 6),
    distortion_model="kannala_brandt",
    distortion=(0.1, 0.2, 0.3, 0.4),
    matrix=(5.0, 0.0, 3.5, 0.0, 5.0, 2.5, 0.0, 0.0, 1.0),
)


def picture(number, ending=".png"):
    """Return a small image file that differs from frame to frame."""
    image = np.full((6, 8), number % 256, np.uint8)
    return cv2.imencode(ending, image)[1].tobytes()


@pytest.fixture
def write(tmp_path):
    """Return what writes a file of images at 15 Hz and returns its path."""

    def make(n=30, *, name="000000.mcap", start_s=0.0, **options):
        path = tmp_path / "frames" / "overhead" / name
        with FrameWriter(path, "overhead", **options) as writer:
            for number in range(n):
                writer.add(start_s + number / FPS, picture(number))
        return path

    return make


def test_images_come_back_as_they_were(write):
    """Bytes and times, to a nanosecond, in order."""
    found = Overview()
    frames = list(read_frames(write(), found=found))
    assert [data for _, data in frames] == [picture(number) for number in range(30)]
    assert [time_s for time_s, _ in frames] == pytest.approx(
        [number / FPS for number in range(30)], abs=1e-9
    )
    assert found.whole
    assert found.lost_bytes == 0


@pytest.mark.parametrize("calibration", [None, KNOWN])
def test_the_doctor_finds_nothing(write, examine, calibration):
    """Neither an error nor a warning, with lineage and without a calibration too."""
    lineage = Lineage(schema=FRAMES, command="simulate", seed=3)
    assert examine(write(calibration=calibration, lineage=lineage)) == []
    assert examine(write(0, name="000060.mcap")) == []


def test_the_doctor_would_find_something(tmp_path, examine):
    """A message outside a chunk, a time that runs backwards, and a header without a library."""
    path = tmp_path / "ill.mcap"
    with path.open("wb") as file:
        writer = Writer(file, use_chunking=False)
        writer.start(library="")
        schema = writer.register_schema("x", "jsonschema", b"{}")
        channel = writer.register_channel("/x", "json", schema)
        writer.add_message(channel, 5, b"{}", 5)
        writer.finish()
    found = " ".join(examine(path))
    assert "outside the chunks" in found
    assert "library" in found
    with path.open("wb") as file:
        writer = Writer(file, compression=CompressionType.ZSTD)
        writer.start(library="x", profile="mine")
        schema = writer.register_schema("x", "jsonschema", b"{}")
        channel = writer.register_channel("/x", "json", schema)
        writer.add_message(channel, 5, b"{}", 5)
        writer.add_message(channel, 4, b"{}", 4)
        writer.finish()
    found = " ".join(examine(path))
    assert "is before 5" in found
    assert "profile 'mine'" in found


def test_a_viewer_reads_image_and_calibration(write):
    """With the library's own decoder: well-known names, the camera's, JPEG or PNG told."""
    path = write(2, calibration=KNOWN)
    with path.open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        messages = [(s.name, c.topic, m) for s, c, _, m in reader.iter_decoded_messages()]
    assert [(schema, topic) for schema, topic, _ in messages] == [
        ("foxglove.CameraCalibration", "/overhead/calibration"),
        ("foxglove.CompressedImage", "/overhead/image"),
        ("foxglove.CompressedImage", "/overhead/image"),
    ]
    calibration, first = messages[0][2], messages[1][2]
    assert (first.format, first.frame_id) == ("png", "overhead")
    assert (calibration.width, calibration.height) == (8, 6)
    assert calibration.distortion_model == "kannala_brandt"
    assert list(calibration.D) == [0.1, 0.2, 0.3, 0.4]
    assert list(calibration.P) == [5, 0, 3.5, 0, 0, 5, 2.5, 0, 0, 0, 1, 0]


def test_jpeg_is_told_from_png(tmp_path):
    """By what stands in it; anything else is refused."""
    path = tmp_path / "a.mcap"
    with FrameWriter(path, "below") as writer:
        writer.add(0.0, picture(1, ".jpg"))
        with pytest.raises(InputError, match="JPEG or PNG, got b'BM"):
            writer.add(0.1, picture(1, ".bmp"))
    with path.open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        assert [image.format for *_, image in reader.iter_decoded_messages()] == ["jpeg"]
    assert writer.n_frames == 1


def test_lineage_stands_in_the_file(write):
    """As in every other artifact."""
    lineage = Lineage(schema=FRAMES, command="simulate", options={"preset": "hard"}, seed=3)
    assert read_lineage(write(lineage=lineage)) == lineage


def test_a_growing_file_gives_every_image_that_was_added(tmp_path):
    """At once, before it is closed."""
    path = tmp_path / "000000.mcap"
    writer = FrameWriter(path, "overhead")
    for number in range(5):
        writer.add(number / FPS, picture(number))
        found = Overview()
        assert len(list(read_frames(path, found=found))) == number + 1
        assert not found.whole
        assert "still grows" in found.problem
    writer.close()
    writer.close()
    assert overview(path).whole


def test_a_cut_file_loses_the_image_that_was_cut(write):
    """Wherever it is cut; what was lost is told."""
    path = write(10)
    content = path.read_bytes()
    counts = []
    for size in range(9, len(content), 97):
        path.write_bytes(content[:size])
        found = Overview()
        counts.append(len(list(read_frames(path, found=found))))
        assert found.read_bytes + found.lost_bytes == size
    assert counts == sorted(counts)
    assert counts[-1] == 10


def test_a_flipped_byte_ends_the_reading_before_it(write):
    """A checksum notices; the images before it are good."""
    path = write(10)
    content = bytearray(path.read_bytes())
    place = content.index(picture(5)) + 20
    content[place] ^= 0xFF
    path.write_bytes(content)
    found = Overview()
    frames = list(read_frames(path, found=found))
    assert [data for _, data in frames] == [picture(number) for number in range(5)]
    assert "damaged record" in found.problem
    # By the index, the images behind the damage cannot be trusted either.
    assert list(read_frames(path, start_s=4.6 / FPS, found=(again := Overview()))) == []
    assert "damaged record" in again.problem


def test_reading_starts_where_it_is_asked_to(write):
    """By the index of a whole file, and by reading past the rest in one that still grows."""
    path = write(30)
    assert [d for _, d in read_frames(path, start_s=20 / FPS)] == [
        picture(n) for n in range(20, 30)
    ]
    path.write_bytes(path.read_bytes()[:-60])
    assert [d for _, d in read_frames(path, start_s=20 / FPS)] == [
        picture(n) for n in range(20, 30)
    ]


def test_a_folder_is_read_in_the_order_of_its_seconds(write):
    """Other files are none of it; reading may start in the second one."""
    first = write(30)
    second = write(30, name="000060.mcap", start_s=60.0)
    (first.parent / ".000120.mcap.part-1").write_bytes(b"x")
    (first.parent / "notes.txt").write_text("x")
    assert frame_segments(first.parent) == [first, second]
    times = [time_s for time_s, _ in read_frames(first.parent)]
    assert len(times) == 60
    assert times == sorted(times)
    assert next(read_frames(first.parent, start_s=60.0))[0] == 60.0
    first.write_bytes(first.read_bytes()[:-200])
    found = Overview()
    assert len(list(read_frames(first.parent, found=found))) == 60
    assert not found.whole


def test_time_does_not_run_backwards(tmp_path, examine):
    """Nor is it NaN or before the start; the same time twice is a camera's own affair."""
    with FrameWriter(tmp_path / "a.mcap", "overhead") as writer:
        writer.add(1.0, picture(0))
        writer.add(1.0, picture(1))
        with pytest.raises(InputError, match="must not run backwards"):
            writer.add(0.9, picture(2))
        for wrong in (float("nan"), -0.1, float("inf")):
            with pytest.raises(InputError, match="0 s or later"):
                writer.add(wrong, picture(2))
    assert examine(tmp_path / "a.mcap") == []


def test_an_existing_file_is_never_overwritten(write, tmp_path):
    """A recording is precious."""
    path = write(3)
    with pytest.raises(InputError, match=r"000000\.mcap: exists already"):
        FrameWriter(path, "overhead")
    with pytest.raises(StorageError, match="cannot be written"):
        FrameWriter(path / "000000.mcap", "overhead")
    assert len(list(read_frames(path))) == 3


def test_files_without_images_are_named(tmp_path, write_mcap):
    """Poses, several cameras in one file, an empty folder, a file of another kind."""
    poses = tmp_path / "poses.mcap"
    write_mcap(poses)
    with pytest.raises(InputError, match=r"no camera images .*/agents"):
        list(read_frames(poses))
    with pytest.raises(InputError, match="holds no images"):
        list(read_frames(tmp_path))
    (tmp_path / "x.mcap").write_bytes(b"RIFF")
    with pytest.raises(DamagedError, match="not an MCAP file"):
        list(read_frames(tmp_path / "x.mcap"))
    with pytest.raises(InputError, match="no such file"):
        list(read_frames(tmp_path / "y.mcap", start_s=3.0))


def test_a_message_that_is_no_image_is_damage(tmp_path):
    """Whoever wrote it under that name."""
    path = tmp_path / "a.mcap"
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start(library="x")
        schema = writer.register_schema("foxglove.CompressedImage", "protobuf", b"x")
        channel = writer.register_channel("/overhead/image", "protobuf", schema)
        writer.add_message(channel, 5, b"\xff\xff\xff", 5)
        writer.finish()
    with pytest.raises(DamagedError, match="cannot be decoded"):
        list(read_frames(path))


def test_two_cameras_in_one_file_are_refused(tmp_path):
    """Nobody can say whose images are meant."""
    path = tmp_path / "a.mcap"
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start(library="x")
        schema = writer.register_schema("foxglove.CompressedImage", "protobuf", b"x")
        for name in ("/overhead/image", "/below/image"):
            channel = writer.register_channel(name, "protobuf", schema)
            writer.add_message(channel, 5, b"", 5)
        writer.finish()
    with pytest.raises(InputError, match="several cameras: /overhead/image and /below/image"):
        list(read_frames(path))
