"""RoboFish files: categories, samplings, the centre of the world, and the way y counts."""

import numpy as np
import pytest

from zfcal.readers import guess_format
from zfcal.tracks import FISH, ROBOT

h5py = pytest.importorskip("h5py")

STEPS = np.arange(5)
SWIM_CM = np.stack([STEPS * 1.0, np.full(5, 20.0)], axis=1)
RIGHT = np.tile([1.0, 0.0], (5, 1))
UP = np.tile([0.0, 1.0], (5, 1))
SIZE_CM = [100.0, 80.0]


@pytest.fixture
def make(tmp_path):
    """Return what writes entities as robofish-io does, and lets something be changed then."""

    def writer(change=None, **entities):
        path = tmp_path / "tank.hdf5"
        with h5py.File(path, "w") as file:
            file.attrs["format_version"] = np.array([1, 0], dtype=np.int32)
            file.attrs["format_url"] = "track format"
            file.attrs["world_size_cm"] = np.array(SIZE_CM, dtype=np.float32)
            file.create_group("samplings/15 hz").attrs["frequency_hz"] = np.float32(15)
            file["samplings"].attrs["default"] = "15 hz"
            for name, (category, xy_cm, along) in (entities or USUAL).items():
                group = file.create_group(f"entities/{name}")
                group.attrs["category"] = category
                group["positions"] = np.asarray(xy_cm, dtype=np.float32)
                if along is not None:
                    group["orientations"] = np.asarray(along, dtype=np.float32)
            if change is not None:
                change(file)
        return path

    return writer


USUAL = {
    "fish_1": ("fish", SWIM_CM, RIGHT),
    "fish_2": ("organism", -SWIM_CM, UP),
    "lure": ("robot", [[-10.0, 5.0]] * 5, UP),
    "stone": ("obstacle", [[0.0, 0.0]], None),
}


def test_fish_and_robots_are_told_by_their_category(make, read):
    """Whatever they are called; a stone is no agent, and that is said."""
    path = make()

    found = read(path, "robofish")

    assert guess_format(path) == "robofish"
    assert found.tracks.kind[:3].tolist() == [FISH, FISH, ROBOT]
    assert found.tracks.agent[:3].tolist() == [0, 1, 2]
    assert "Agents are numbered: fish_1 = 0, fish_2 = 1, lure = 2." in found.notes
    assert any("left out: stone (obstacle)" in note for note in found.notes)


def test_the_names_of_robofish_io_give_numbers_and_categories_give_kinds(make, read):
    """fish_1 and robot_2 keep their numbers; a robot that is called fish_3 stays a robot."""
    path = make(
        fish_1=("organism", SWIM_CM, None),
        robot_2=("robot", SWIM_CM, None),
        fish_3=("robot", SWIM_CM, None),
    )

    tracks = read(path, "robofish").tracks

    assert tracks.agent[:3].tolist() == [1, 2, 3]
    assert tracks.kind[:3].tolist() == [FISH, ROBOT, ROBOT]


def test_positions_are_metres_about_the_centre_of_the_world(make, read):
    """Fish 1 at (4, 20) cm at last; the corner of a world of 100 x 80 cm is at (-50, -40) cm."""
    centred = read(make(), "robofish").tracks
    cornered = read(make(), "robofish", origin=(-50.0, -40.0)).tracks

    assert (centred.x_m[-3], centred.y_m[-3]) == pytest.approx((0.04, 0.20))
    assert (cornered.x_m[-3], cornered.y_m[-3]) == pytest.approx((0.54, 0.60))
    assert centred.heading_rad[:3] == pytest.approx([0, np.pi / 2, np.pi / 2])


def test_the_direction_of_y_is_a_persons_to_say_and_is_told(make, read):
    """Taken as up with the words to turn it; turned, positions and headings are mirrored."""
    up = read(make(), "robofish")
    turned = read(make(), "robofish", flip_y=True, origin=(-50.0, 40.0))

    (note,) = [note for note in up.notes if "which way y counts" in note]
    assert "upwards is assumed" in note
    assert "--flip-y and --origin 0,0 (centre) or -50,40 (corner)" in note
    assert "--origin -50,-40 puts the lower left corner" in note
    assert any("it was turned, as --flip-y says" in note for note in turned.notes)
    assert turned.tracks.y_m[:3] == pytest.approx([0.20, 0.60, 0.35])
    assert turned.tracks.heading_rad[:3] == pytest.approx([0, -np.pi / 2, -np.pi / 2])


def test_lost_samples_are_nan_and_no_rows(make, read):
    """A heading may be lost alone; BioTracker writes (0, 0) for one that it does not know."""
    xy_cm, along = SWIM_CM.copy(), RIGHT.copy()
    xy_cm[2], along[3], along[4] = np.nan, np.nan, 0

    found = read(make(fish_1=("fish", xy_cm, along)), "robofish")

    assert found.tracks.frame.tolist() == [0, 1, 3, 4]
    assert np.isnan(found.tracks.heading_rad).tolist() == [False, False, True, True]
    assert "1 of 5 positions are missing." in found.notes


def test_without_orientations_headings_are_unknown(make, read):
    """The substitute that the format has for drawing is no measurement."""
    assert np.isnan(read(make(a=("fish", SWIM_CM, None)), "robofish").tracks.heading_rad).all()


def test_one_sample_holds_for_the_whole_recording(make, read):
    """A robot that is fixed in place, and a fish of fixed orientation."""
    path = make(a=("fish", SWIM_CM, [[0.0, 1.0]]), b=("robot", [[3.0, 4.0]], [[1.0, 0.0]]))

    tracks = read(path, "robofish").tracks

    assert tracks.x_m[tracks.kind == ROBOT] == pytest.approx([0.03] * 5)
    assert tracks.heading_rad[tracks.kind == FISH] == pytest.approx([np.pi / 2] * 5)


def test_a_robot_of_one_sample_is_told_by_name_and_such_a_fish_is_refused(make, read, refused):
    """A robot is fixed in place; no fish stands still for a whole recording, lost it may be."""
    still = [[3.0, 4.0]]
    found = read(make(a=("fish", SWIM_CM, RIGHT), lure=("robot", still, None)), "robofish")
    assert "One sample holds for all 5, as of robots: lure." in found.notes
    fish = make(a=("fish", SWIM_CM, RIGHT), b=("organism", still, None))
    assert "entities/b is a fish with one sample, expected 5" in refused(fish, "robofish")
    lost = make(a=("fish", SWIM_CM, RIGHT), b=("fish", [[np.nan, np.nan]], None))
    assert read(lost, "robofish").tracks.agent.tolist() == [0] * 5
    assert len(read(make(a=("fish", still, None)), "robofish").tracks) == 1


def test_entities_of_one_sampling_are_alike_whatever_its_rate(make, read):
    """A rate that is no number says nothing, and is told."""
    path = make(_stated("frequency_hz", np.nan, "samplings/15 hz"))

    found = read(path, "robofish")

    assert len(found.tracks) == 15
    assert "The file states no usable frame rate (nan)." in found.notes


def test_an_entity_that_ends_early_is_missing_afterwards(make, read):
    """Nothing is filled in; it is said."""
    path = make(a=("fish", SWIM_CM, RIGHT), b=("fish", SWIM_CM[:3], RIGHT[:3]))

    found = read(path, "robofish")

    assert found.tracks.frame[found.tracks.agent == 1].tolist() == [0, 1, 2]
    assert "Some end before the last of 5 samples: b (3)." in found.notes


def _second_clock(file):
    file.create_group("samplings/other").attrs["frequency_hz"] = np.float32(25)


def _on_second_clock(file):
    _second_clock(file)
    file["entities/fish_2"].attrs["sampling"] = "other"


def _same_rate_by_another_name(file):
    file.create_group("samplings/again").attrs["frequency_hz"] = np.float32(15)
    file["entities/fish_2"].attrs["sampling"] = "again"


def _no_default(file):
    _second_clock(file)
    del file["samplings"].attrs["default"]


def _times(*times_us):
    def change(file):
        clock = file["samplings/15 hz"]
        clock["monotonic_time_points_us"] = np.array(times_us, dtype=np.int64)

    return change


def test_entities_of_different_samplings_are_refused_and_of_like_ones_read(make, read, refused):
    """Nothing is interpolated; a clock that nobody uses does not matter."""
    message = refused(make(_on_second_clock), "robofish")

    assert "fish_1 is of sampling '15 hz', fish_2 of 'other'; expected one clock" in message
    assert len(read(make(_same_rate_by_another_name), "robofish").tracks) == 15
    unused = read(make(_second_clock), "robofish")
    assert len(unused.tracks) == 15
    assert "Sampling '15 hz' is taken, not used: other." in unused.notes


def test_times_of_samples_are_taken_and_compared_with_the_rate(make, read, refused):
    """In microseconds, from the first; at 25 Hz the file does not fit a trial of 15 Hz."""
    times_us = 7_000_000 + np.array([0, 66_000, 134_000, 200_000, 333_000])
    tracks = read(make(_times(*times_us), a=("fish", SWIM_CM, None)), "robofish").tracks

    assert tracks.time_s == pytest.approx([0, 0.066, 0.134, 0.2, 0.333])
    assert tracks.frame.tolist() == [0, 1, 2, 3, 5]
    fast = make(_times(*range(0, 200_000, 40_000)))
    assert "the times advance at 25 Hz, expected fps = 15 Hz" in refused(fast, "robofish")


def test_another_rate_than_the_trials_is_refused(make, refused):
    """Both are named."""
    message = refused(make(), "robofish", fps=30.0)

    assert "the file states 15 frames per second, expected fps = 30" in message


def test_robots_alone_are_read(make, read):
    """For --robot-tracks; the import itself warns where fish are missing."""
    assert read(make(a=("robot", SWIM_CM, UP)), "robofish").tracks.kind.tolist() == [ROBOT] * 5


def _without(name):
    def change(file):
        if name in file.attrs:
            del file.attrs[name]
        else:
            del file[name]

    return change


def _stated(name, value, where="/"):
    def change(file):
        file[where].attrs[name] = value

    return change


def _stored(name, values):
    def change(file):
        del file[name]
        file[name] = values

    return change


def _no_category(file):
    del file["entities/fish_1"].attrs["category"]


def _no_rate(file):
    del file["samplings/15 hz"].attrs["frequency_hz"]


FISH_1 = "entities/fish_1"


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (_without("format_version"), "a RoboFish file with the attribute 'format_version'"),
        (_without("world_size_cm"), "a RoboFish file with the attribute 'world_size_cm', got"),
        (_without("entities"), "expected a RoboFish file with a group 'entities', got samplings"),
        (_without("samplings"), "expected a RoboFish file with a group 'samplings', got entities"),
        (_stated("format_version", [2, 0]), "expected RoboFish's track format 1, got version 2.0"),
        (_stated("format_version", "0.9"), "expected RoboFish's track format 1, got version 0.9"),
        (_stated("world_size_cm", [100.0, -1.0]), "two positive lengths, got [100.0, -1.0]"),
        (_stated("world_size_cm", [9.0, 9.0, 9.0]), "two positive lengths, got [9.0, 9.0, 9.0]"),
        (_stated("world_size_cm", "100 x 100"), "'world_size_cm': expected numbers, got"),
        (_no_category, f"{FISH_1} has no attribute 'category', expected one of fish, organism"),
        (_without(f"{FISH_1}/positions"), f"{FISH_1}: expected a data set 'positions', got orient"),
        (
            _stored(f"{FISH_1}/positions", np.zeros((5, 3))),
            "expected shape (samples, 2), got (5, 3)",
        ),
        (_stored(f"{FISH_1}/positions", np.zeros(5)), "expected shape (samples, 2), got (5,)"),
        (
            _stored(f"{FISH_1}/positions", np.zeros((0, 2))),
            "expected shape (samples, 2), got (0, 2)",
        ),
        (_stored(f"{FISH_1}/positions", [[b"a", b"b"]]), "positions: expected numbers, got"),
        (_stored(f"{FISH_1}/orientations", RIGHT[:4]), "expected as many orientations, got 4"),
        (_stored(f"{FISH_1}/orientations", np.zeros((5, 1))), "(samples, 2), got (5, 1)"),
        (
            _stored(f"{FISH_1}/orientations", RIGHT * 2),
            "expected unit vectors, got (2, 0) in sample",
        ),
        (_stored(FISH_1, [1.0]), f"expected a group {FISH_1}, got a data set"),
        (_no_rate, "neither the attribute 'frequency_hz' nor a data set"),
        (_stated("frequency_hz", "fast", "samplings/15 hz"), "frequency_hz: expected numbers, got"),
        (_no_default, "is of sampling unknown, expected one of 15 hz, other"),
        (_stated("sampling", "gone", FISH_1), "is of sampling gone, expected one of 15 hz"),
        (_times(0, 1, 1, 2, 3), "samplings/15 hz: expected times that advance"),
        (_times(0, 66_667, 133_333), "has 5 positions, expected at most the 3 of sampling '15 hz'"),
    ],
)
def test_a_damaged_file_is_told_in_one_line(change, message, make, refused):
    """Where, what was expected, and what is there."""
    assert message in refused(make(change), "robofish")


def test_a_file_without_animals_is_refused(make, refused):
    """No fish and no robot: what there is instead is named."""
    stone = make(stone=("obstacle", [[0.0, 0.0]], None))
    assert "organism, robot, got stone (obstacle)" in refused(stone, "robofish")

    def empty(file):
        del file["entities"]
        file.create_group("entities")

    assert "organism, robot, got none" in refused(make(empty), "robofish")


def test_nothing_but_nan_is_refused(make, refused):
    """It is no recording of nobody."""
    path = make(a=("fish", SWIM_CM * np.nan, RIGHT))

    assert "expected positions, got none: all 5 are missing" in refused(path, "robofish")


def test_what_is_no_hdf5_or_another_hdf5_is_refused(write, sample, refused):
    """With the format that it looks like."""
    assert "expected a whole HDF5 file" in refused(write("a.hdf5", "x,y\n"), "robofish")
    path, _ = sample("sleap")
    assert "looks like --format sleap" in refused(path, "robofish")
