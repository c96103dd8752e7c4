"""Camera images of a simulated trial."""

import dataclasses
import json

import cv2
import numpy as np
import pytest

from zfcal.artifacts.frame_files import FrameWriter, read_frames
from zfcal.artifacts.lineage import Lineage, read_lineage
from zfcal.artifacts.settings import read_trial
from zfcal.artifacts.tables import read_tracks
from zfcal.cameras.camera import Camera, Homography
from zfcal.errors import InputError
from zfcal.stages.camera.cameras import read_camera, write_camera
from zfcal.stages.events import Made, Planned, Progress, UpToDate, say_nothing
from zfcal.stages.init import NewTrial, create_trial
from zfcal.stages.simulate import SimulateOptions
from zfcal.stages.trial_context import Task
from zfcal.tracks import ROBOT
from zfcal.virtual.film import FilmOptions, film
from zfcal.virtual.film_export import export_video, exported_paths
from zfcal.virtual.filming import rig_fps, simulate_on_film
from zfcal.virtual.images.look import CLEAN, USUAL, look_of
from zfcal.virtual.images.render import OverheadPainter

PLAIN = look_of(
    CLEAN,
    {
        "tail_grey": 52.0,
        "lure_grey": 52.0,
        "stripe_grey": 0.0,
        "fin_opacity": 0.0,
        "exposure_s": 0.0,
    },
)


@pytest.fixture(scope="module")
def home(tmp_path_factory):
    """Return a trial with a model: 2 fish and a robot in two rooms."""
    root = tmp_path_factory.mktemp("home") / "home"
    # Steps of a second: a minute of images is quick to draw.
    new = NewTrial(n_fish=2, n_robots=1, fps=15.0, dt_s=1.0, arena="two-rooms", seed=4)
    create_trial(root, new, say_nothing)
    return root


@pytest.fixture(scope="module")
def filmed(home, tmp_path_factory):
    """Return a trial of 62 s at 1 Hz with images of both cameras, all plain and lossless."""
    root = tmp_path_factory.mktemp("filmed") / "filmed"
    simulate_on_film(root, of(home, duration_s=62.0, fps=1.0), FilmOptions(look=PLAIN), say_nothing)
    return root


def of(home, **changes):
    """Return what to simulate: 3 s with seed 2."""
    given = {"model": home / "models" / "000000.toml", "duration_s": 3.0, "seed": 2}
    return SimulateOptions(**(given | changes))


def images(root, camera):
    """Return the times and images of a camera."""
    frames = list(read_frames(root / "frames" / camera))
    flags = cv2.IMREAD_UNCHANGED
    pictures = [cv2.imdecode(np.frombuffer(data, np.uint8), flags) for _, data in frames]
    return np.array([time_s for time_s, _ in frames]), pictures


@pytest.mark.slow
def test_there_is_an_image_for_each_frame_of_the_tracks(filmed):
    """With its time, in files of a minute; both cameras take them at once."""
    tracks = [read_tracks(path) for path in sorted((filmed / "tracks").glob("*.parquet"))]
    times = np.unique(np.concatenate([part.time_s for part in tracks]))
    assert len(times) == 62
    for camera in ("overhead", "below"):
        names = sorted(path.name for path in (filmed / "frames" / camera).iterdir())
        assert names == ["000000.mcap", "000060.mcap"]
        found = [time_s for time_s, _ in read_frames(filmed / "frames" / camera)]
        np.testing.assert_allclose(found, times, atol=1e-9)
    late = [time_s for time_s, _ in read_frames(filmed / "frames" / "below" / "000060.mcap")]
    assert len(late) == 2
    assert late[0] == 60.0


@pytest.mark.slow
def test_the_tracks_are_the_truth_of_the_images(filmed):
    """Everybody's pixels together have the centroid of the rows, through the camera's file."""
    camera = read_camera(filmed / "cameras" / "overhead.toml")
    tracks = read_tracks(filmed / "tracks" / "000000.parquet")
    _, pictures = images(filmed, "overhead")
    empty = np.median(pictures, axis=0)
    off_mm = []
    for frame in range(60):
        rows = tracks.frame == frame
        xy_m = np.column_stack([tracks.x_m[rows], tracks.y_m[rows]])
        apart = np.linalg.norm(xy_m[:, None] - xy_m[None], axis=-1) + np.eye(3)
        if apart.min() < 0.05:
            continue
        dark = np.clip(empty - pictures[frame], 0, None)
        for place in xy_m:
            x, y = np.rint(camera.to_pixels(place)).astype(int)
            cut = np.s_[max(y - 14, 0) : y + 15, max(x - 14, 0) : x + 15]
            weight = dark[cut] * (dark[cut] > 4)
            down, across = np.mgrid[cut]
            middle = np.array([(across * weight).sum(), (down * weight).sum()]) / weight.sum()
            off_mm.append(1e3 * np.hypot(*(camera.to_metres(middle) - place)))
    assert len(off_mm) >= 30
    # At a wall a part of a body lies over brighter ground and weighs more.
    assert np.median(off_mm) < 0.1
    assert np.percentile(off_mm, 80) < 0.6


def test_leds_lie_at_the_robot(filmed):
    """The green in the image from below has its centroid at the robot's row."""
    camera = read_camera(filmed / "cameras" / "below.toml")
    tracks = read_tracks(filmed / "tracks" / "000000.parquet")
    _, pictures = images(filmed, "below")
    for frame in (0, 20, 59):
        row = (tracks.frame == frame) & (tracks.kind == ROBOT)
        blue, green, red = np.moveaxis(pictures[frame].astype(float), -1, 0)
        weight = np.clip(green - np.maximum(blue, red) - 8, 0, None)
        down, across = np.indices(weight.shape)
        middle = np.array([(across * weight).sum(), (down * weight).sum()]) / weight.sum()
        expected = (tracks.x_m[row][0], tracks.y_m[row][0])
        np.testing.assert_allclose(camera.to_metres(middle), expected, atol=3e-4)


def test_files_pass_the_doctor_and_say_where_they_come_from(filmed, examine):
    """With tracks and camera as inputs, and the whole look as options."""
    path = filmed / "frames" / "overhead" / "000000.mcap"
    assert examine(path) == []
    lineage = read_lineage(path)
    assert (lineage.schema, lineage.command, lineage.seed) == ("zfcal.frames/1", "simulate", 2)
    assert set(lineage.inputs) == {
        "cameras/overhead.toml",
        "tracks/000000.parquet",
        "tracks/000060.parquet",
    }
    assert lineage.options["look"]["fish_length_m"] == PLAIN.fish_length_m


def test_a_new_trial_is_at_the_rig_s_rate_and_names_its_cameras(home, tmp_path):
    """15 Hz, a multiple of the model's step; files of schema zfcal.camera/1."""
    root = tmp_path / "t"
    simulate_on_film(root, of(home, duration_s=1.0), FilmOptions(look=PLAIN), say_nothing)
    trial = read_trial(root)
    assert (trial.fps, trial.dt_s) == (15.0, 1.0)
    assert len(images(root, "overhead")[0]) == 15
    assert trial.cameras == {
        "overhead": {"file": "cameras/overhead.toml"},
        "below": {"file": "cameras/below.toml"},
    }


@pytest.mark.parametrize(("dt_s", "fps"), [(0.2, 15.0), (0.1, 20.0), (1 / 3, 15.0), (2.0, 15.0)])
def test_the_rate_is_a_multiple_of_the_model_s(dt_s, fps):
    """The one nearest to 15 Hz."""
    assert rig_fps(dt_s) == pytest.approx(fps)


def test_no_robot_no_camera_below(home, tmp_path):
    """It would see nothing."""
    root = tmp_path / "alone"
    options = of(home, n_fish=1, n_robots=0, duration_s=1.0)
    simulate_on_film(root, options, FilmOptions(look=PLAIN), say_nothing)
    assert [path.name for path in (root / "frames").iterdir()] == ["overhead"]
    assert list(read_trial(root).cameras) == ["overhead"]


@pytest.mark.slow
def test_the_same_again_does_nothing(home, tmp_path, heard, read_all):
    """Everything is up to date; a missing file comes back with the same bytes."""
    root = tmp_path / "t"
    options, filmed = of(home), FilmOptions(look=look_of(USUAL))
    simulate_on_film(root, options, filmed, heard.append)
    assert any(isinstance(event, Progress) and event.stage == "below images" for event in heard)
    before = read_all(root)
    heard.clear()
    simulate_on_film(root, options, filmed, heard.append)
    assert {type(event) for event in heard} == {UpToDate}
    (root / "frames" / "below" / "000000.mcap").unlink()
    (root / "cameras" / "overhead.toml").unlink()
    heard.clear()
    simulate_on_film(root, options, filmed, heard.append)
    assert {event.path.name for event in heard if isinstance(event, Made)} == {
        "000000.mcap",
        "overhead.toml",
    }
    assert read_all(root) == before


def test_an_interrupted_drawing_is_taken_up(home, tmp_path, monkeypatch, read_all):
    """Nothing half drawn is left, and the end is that of an undisturbed run."""
    options, filmed = (
        of(home, duration_s=61.0, fps=1.0, n_fish=2, n_robots=0),
        FilmOptions(look=look_of(USUAL)),
    )
    simulate_on_film(tmp_path / "whole" / "t", options, filmed, say_nothing)
    root = tmp_path / "broken" / "t"
    painted = []

    def interrupt(painter, moment, paint=OverheadPainter.paint):
        painted.append(moment.number)
        if len(painted) == 61:
            raise KeyboardInterrupt
        return paint(painter, moment)

    with monkeypatch.context() as patch:
        patch.setattr(OverheadPainter, "paint", interrupt)
        with pytest.raises(KeyboardInterrupt):
            simulate_on_film(root, options, filmed, say_nothing)
    folder = root / "frames" / "overhead"
    assert [path.name for path in folder.iterdir()] == ["000000.mcap"]
    simulate_on_film(root, options, filmed, say_nothing)
    assert read_all(root) == read_all(tmp_path / "whole" / "t")


def test_another_look_or_seed_draws_anew(home, tmp_path, heard):
    """The tracks stay for another look; a shorter simulation takes its images with it."""
    root = tmp_path / "t"
    simulate_on_film(
        root,
        of(home, duration_s=61.0, fps=1.0, n_fish=2, n_robots=0),
        FilmOptions(look=PLAIN),
        say_nothing,
    )
    bright = dataclasses.replace(PLAIN, floor_grey=200.0)
    simulate_on_film(
        root,
        of(home, duration_s=61.0, fps=1.0, n_fish=2, n_robots=0),
        FilmOptions(look=bright),
        heard.append,
    )
    made = {
        event.path.relative_to(root).as_posix(): event.reason
        for event in heard
        if isinstance(event, Made)
    }
    assert sorted(made) == [f"frames/overhead/{start}.mcap" for start in ("000000", "000060")]
    assert all(reason.startswith("option look: ") for reason in made.values())
    heard.clear()
    simulate_on_film(
        root, of(home, fps=1.0, n_fish=2, n_robots=0), FilmOptions(look=bright), heard.append
    )
    assert [path.name for path in (root / "frames" / "overhead").iterdir()] == ["000000.mcap"]


def test_a_dry_run_says_what_would_be_drawn(home, tmp_path, heard, read_all):
    """Of a trial that is not there, of tracks that would change, and of another look."""
    root = tmp_path / "t"
    dry = Task(dry_run=True)

    def planned(options, look=PLAIN, video=None):
        heard.clear()
        wanted = FilmOptions(look=look, video=video)
        simulate_on_film(root, options, wanted, heard.append, task=dry)
        return {e.path.relative_to(tmp_path).as_posix() for e in heard if isinstance(e, Planned)}

    video = tmp_path / "v.avi"
    both = {"t/frames/overhead/000000.mcap", "t/frames/below/000000.mcap"}
    assert planned(of(home), video=video) >= both | {"v.avi", "v-below.avi"}
    assert not root.exists()
    simulate_on_film(root, of(home, duration_s=1.0), FilmOptions(look=PLAIN), say_nothing)
    before = read_all(root)
    assert planned(of(home, duration_s=1.0), video=video) == {"v.avi", "v-below.avi"}
    assert planned(of(home)) == both | {"t/tracks/000000.parquet"}
    assert planned(of(home, duration_s=1.0), look_of(USUAL), video=video) == both | {
        "v.avi",
        "v-below.avi",
    }
    assert read_all(root) == before


def test_a_calibrated_camera_is_drawn_with(home, tmp_path):
    """The one that the trial names; it stays as it is."""
    root = tmp_path / "t"
    simulate_on_film(root, of(home, duration_s=0.5), FilmOptions(look=PLAIN), say_nothing)
    grid = Homography(
        size_px=(320, 300), matrix=((0.0035, 0, -0.05), (0, -0.0035, 1.02), (0, 0, 1))
    )
    path = root / "cameras" / "overhead.toml"
    write_camera(path, grid, Lineage(schema="zfcal.camera/1", command="camera corners"))
    before = path.read_bytes()
    film(root, FilmOptions(look=PLAIN), say_nothing)
    assert path.read_bytes() == before
    assert images(root, "overhead")[1][0].shape == (300, 320)
    path.unlink()
    # Its absence is a mistake only where nobody can make it again.
    film(root, FilmOptions(look=PLAIN), say_nothing)
    assert isinstance(read_camera(path), Camera)


def test_a_camera_file_that_is_gone_is_named(home, tmp_path):
    """If it lay elsewhere than the drawn ones do."""
    root = tmp_path / "t"
    simulate_on_film(root, of(home, duration_s=0.5), FilmOptions(look=PLAIN), say_nothing)
    config = root / "trial.toml"
    config.write_text(config.read_text().replace("cameras/overhead", "cameras/mine"))
    with pytest.raises(InputError, match=r"cameras/mine\.toml, which is missing"):
        film(root, FilmOptions(look=PLAIN), say_nothing)


def test_recorded_images_are_not_replaced(home, tmp_path):
    """Only by force."""
    root = tmp_path / "t"
    simulate_on_film(root, of(home, duration_s=0.5), FilmOptions(look=PLAIN), say_nothing)
    path = root / "frames" / "overhead" / "000000.mcap"
    data = next(read_frames(path))[1]
    path.unlink()
    recorded = Lineage(schema="zfcal.frames/1", command="track")
    with FrameWriter(path, "overhead", lineage=recorded) as writer:
        writer.add(0.0, data)
    with pytest.raises(InputError, match="was recorded by track"):
        film(root, FilmOptions(look=PLAIN), say_nothing)
    film(root, FilmOptions(look=PLAIN), say_nothing, task=Task(force=True))
    assert read_lineage(path).command == "simulate"


def test_nothing_to_draw_is_said(home):
    """A trial without tracks."""
    with pytest.raises(InputError, match="has no tracks"):
        film(home, FilmOptions(), say_nothing)


def test_a_photograph_lies_under_the_fish(home, tmp_path):
    """Its hash stands in the lineage, not its path."""
    root, photo = tmp_path / "t", tmp_path / "photo.png"
    ground = np.full((512, 512), 200, np.uint8)
    ground[:256] = 120
    cv2.imwrite(str(photo), ground)
    filmed = FilmOptions(look=PLAIN, photograph=photo)
    simulate_on_film(root, of(home, duration_s=0.5), filmed, say_nothing)
    picture = images(root, "overhead")[1][0]
    assert np.median(picture[:240]) == 120
    assert np.median(picture[260:]) == 200
    assert "photo.png" in read_lineage(root / "frames" / "overhead" / "000000.mcap").inputs
    assert "photo.png" not in read_lineage(root / "frames" / "below" / "000000.mcap").inputs


@pytest.mark.parametrize("ending", [".avi", ".mkv"])
def test_a_plain_video_holds_the_same_pixels(home, tmp_path, heard, ending):
    """As many frames as the tracks, at the trial's rate, bit by bit; made once."""
    root, video = tmp_path / "t", tmp_path / f"v{ending}"
    drawn = FilmOptions(look=look_of(USUAL), video=video)
    simulate_on_film(root, of(home, duration_s=0.4), drawn, heard.append)
    for camera, path in exported_paths(video, ("overhead", "below")).items():
        reader = cv2.VideoCapture(str(path))
        assert reader.get(cv2.CAP_PROP_FPS) == 15
        _, pictures = images(root, camera)
        for picture in pictures:
            _, image = reader.read()
            assert np.array_equal(image if picture.ndim == 3 else image[..., 0], picture)
        assert not reader.read()[0]
        assert len(pictures) == 6
    note = json.loads((tmp_path / f"v{ending}.json").read_text())
    assert note["lineage"]["inputs"].keys() == {"frames/overhead/000000.mcap"}
    heard.clear()
    simulate_on_film(root, of(home, duration_s=0.4), drawn, heard.append)
    assert {type(event) for event in heard} == {UpToDate}
    video.unlink()
    heard.clear()
    export_video(root, video, heard.append)
    assert [event.path for event in heard if isinstance(event, Made)] == [video]
    assert not [path for path in tmp_path.iterdir() if path.name.startswith(".")]


@pytest.mark.slow
def test_an_mp4_can_be_looked_at(filmed, tmp_path):
    """Small, and not the same pixels."""
    video = tmp_path / "v.mp4"
    export_video(filmed, video, say_nothing)
    assert cv2.VideoCapture(str(video)).get(cv2.CAP_PROP_FRAME_COUNT) == 62
    assert video.stat().st_size < 5e6


def test_a_video_of_another_kind_is_refused_before_anything_is_done(home, tmp_path):
    """With the kinds that there are."""
    root = tmp_path / "t"
    with pytest.raises(InputError, match="no video file that can be written") as error:
        simulate_on_film(root, of(home), FilmOptions(video=tmp_path / "v.gif"), say_nothing)
    assert ".avi, .mkv, .mp4" in error.value.hint
    assert not root.exists()
    create_trial(root, NewTrial(n_fish=1, fps=15.0, arena="two-rooms"), say_nothing)
    with pytest.raises(InputError, match="holds no images"):
        export_video(root, tmp_path / "v.avi", say_nothing)
