"""All formats together: one motion, one result; and the registry's own refusals."""

import sys

import numpy as np
import pytest

from zfcal.errors import InputError
from zfcal.readers import FORMATS, ImportOptions, guess_format, read_foreign

NAMES = tuple(FORMATS)

METRIC = {"csv", "cats", "trex", "robofish", "fishmodel"}
"""Formats in metres or centimetres."""

RATELESS = {"mot", "sleap", "deeplabcut", "fishmodel"}
"""Formats without times and without a rate."""

HDF5 = {"idtracker", "sleap", "movement", "nwb", "robofish"}
"""Samples that are HDF5: bytes flipped in there can crash the HDF5 library itself."""


def test_the_contract_names_these_formats():
    """The names of --format are a promise to scripts."""
    assert NAMES == (
        "csv",
        "cats",
        "trex",
        "idtracker",
        "trajectorytools",
        "mot",
        "sleap",
        "deeplabcut",
        "movement",
        "nwb",
        "robofish",
        "fishmodel",
    )


@pytest.mark.parametrize("name", NAMES)
def test_every_format_tells_the_same_two_fish(name, sample, read):
    """Positions in metres by hand, one missing row, times in seconds from 0."""
    path, options = sample(name)

    tracks = read(path, name, **options).tracks

    assert tracks.frame.tolist() == [0, 0, 1, 1, 2, 3, 3]
    assert tracks.agent.tolist() == [0, 1, 0, 1, 0, 0, 1]
    assert tracks.kind.tolist() == [0] * 7
    assert tracks.time_s == pytest.approx(tracks.frame / 15, abs=1e-3)
    assert tracks.x_m == pytest.approx([0.10, 0.30, 0.11, 0.30, 0.12, 0.13, 0.30], abs=1e-12)
    assert tracks.y_m == pytest.approx([0.20, 0.40, 0.20, 0.39, 0.20, 0.20, 0.37], abs=1e-12)
    assert (tracks.confidence > 0.5).all()


@pytest.mark.parametrize("name", NAMES)
def test_every_format_has_the_columns_and_types_of_tracks(name, sample):
    """What is written to Parquet later must not depend on where it came from."""
    path, options = sample(name)

    tracks = read_foreign(path, name, ImportOptions(fps=15.0, **options))

    assert tracks.time_s.dtype == np.float64
    assert tracks.frame.dtype == np.int64
    assert tracks.agent.dtype == np.int32
    assert tracks.kind.dtype == np.int8
    assert tracks.x_m.dtype == tracks.y_m.dtype == np.float64
    assert tracks.heading_rad.dtype == tracks.confidence.dtype == np.float32


@pytest.mark.parametrize("name", NAMES)
def test_every_format_turns_y_up_about_the_origin(name, sample, read):
    """The point given as the origin becomes (0, 0): x - 0.1, 0.5 - y."""
    path, options = sample(name)
    per_metre = {"trex": 100, "robofish": 100}.get(name, 1 if name in METRIC else 1000)
    origin = (0.1 * per_metre, 0.5 * per_metre)

    tracks = read(path, name, **options, flip_y=True, origin=origin).tracks

    assert tracks.x_m == pytest.approx([0.0, 0.20, 0.01, 0.20, 0.02, 0.03, 0.20], abs=1e-12)
    assert tracks.y_m == pytest.approx([0.30, 0.10, 0.30, 0.11, 0.30, 0.30, 0.13], abs=1e-12)


@pytest.mark.parametrize("name", sorted(set(NAMES) - METRIC))
def test_nothing_in_pixels_is_called_metres_without_a_scale(name, sample, refused):
    """The hint names the option that gives the scale."""
    path, _ = sample(name)

    message = refused(path, name)

    assert "positions are in pixels, expected a scale, got none" in message
    assert "--mm-per-px" in message


@pytest.mark.parametrize("name", sorted(METRIC))
def test_a_scale_for_metres_or_centimetres_cannot_take_effect(name, sample, refused):
    """An option that is without effect is an error, never passed over."""
    path, _ = sample(name)

    assert "cannot take effect" in refused(path, name, m_per_px=0.001)


@pytest.mark.parametrize("name", sorted(set(NAMES) - RATELESS))
def test_another_frame_rate_is_refused_with_both_rates(name, sample, refused):
    """Formats with times or a stated rate are compared with --fps."""
    path, options = sample(name)

    message = refused(path, name, **options, fps=25.0)

    assert "15" in message
    assert "25" in message


@pytest.mark.parametrize("name", NAMES)
def test_more_fish_at_once_than_the_trial_has_are_refused(name, sample, refused):
    """The message names the first frame that has too many."""
    path, options = sample(name)

    message = refused(path, name, **options, n_fish=1)

    assert "frame 0 has 2 fish at once, expected at most 1." in message


@pytest.mark.parametrize("name", NAMES)
def test_an_agent_can_be_named_a_robot(name, sample, read):
    """By the name that the file has for it, or by its number."""
    path, options = sample(name)
    robot = "fish1" if name == "cats" else "1"

    tracks = read(path, name, **options, robots=(robot,), n_fish=1, n_robots=1).tracks

    assert tracks.kind.tolist() == tracks.agent.tolist()


@pytest.mark.parametrize("name", NAMES)
def test_a_file_looks_like_its_own_format(name, sample):
    """It is taken when no format is named, and it serves hints."""
    path, _ = sample(name)

    assert guess_format(path) == name


@pytest.mark.parametrize(
    ("name", "text", "expected"),
    [
        ("a.csv", "frame,id,x_px,y_px\n", "csv"),
        ("a.csv", "frame,id,x,y,width,height,confidence\n", "mot"),
        ("a.txt", "1,3,794.27,247.59,71.245,174.88,-1,-1,-1,-1\n", "mot"),
        ("a.csv", "time,x1,y1,x2,y2\n", "idtracker"),
        ("a.csv", "frame,time,individual,x,y,probability\n", "idtracker"),
        ("a.csv", "frame,time,X#wcentroid (cm),Y#wcentroid (cm)\n", "trex"),
        ("a.csv.gz", "scorer,net\n", "deeplabcut"),
        ("a.txt", "X1\tY1\tProbId1\t\n", "idtracker"),
        ("aa", "0.000000\t0.1 0.2 -3e-05\t1 0.5 6.28\n", "fishmodel"),
        ("aa", "0.000000\t0.1 0.2 1.5\t1 0.5\n", None),
        ("aa", "0.000000\t0.1\t0.2\t1.5\n", None),
        ("aa", "0.000000 0.1 0.2 1.5\n", None),
        ("a.txt", "something else\n", None),
        ("a.h5", "no HDF5", None),
        ("a.slp", "", "sleap"),
        ("A.SLP", "", "sleap"),
        ("A.NWB", "", "nwb"),
        ("a.csv", "", None),
    ],
)
def test_a_file_is_guessed_by_its_ending_or_its_first_line(name, text, expected, write):
    """Nothing else of it is read; what is like nothing is not guessed."""
    assert guess_format(write(name, text)) == expected


HELD = {
    "idtracker": "trajectories",
    "sleap": "tracks",
    "movement": "position",
    "nwb": "processing/SLEAP_VIDEO_000_tank/track=0/body/data",
    "robofish": "entities/0/positions",
}
"""Data sets of the samples."""


def _moved(path, name, how):
    """Move a data set into another file, and leave a way to it."""
    h5py = pytest.importorskip("h5py")
    raw = path.with_name("raw.h5")
    with h5py.File(path, "a") as file, h5py.File(raw, "w") as other:
        values, attributes = file[name][()], dict(file[name].attrs)
        other["x"] = values
        scales = [axis[0] if len(axis) else None for axis in file[name].dims]
        del file[name]
        if how == "linked":
            other["x"].attrs.update({k: v for k, v in attributes.items() if "DIM" not in k})
            file[name] = h5py.ExternalLink(raw.name, "/x")
            return
        if how == "soft":
            file["away"] = h5py.ExternalLink(raw.name, "/x")
            file[name] = h5py.SoftLink("/away")
            return
        if how == "virtual":
            layout = h5py.VirtualLayout(shape=values.shape, dtype=values.dtype)
            layout[...] = h5py.VirtualSource(other["x"])
            made = file.create_virtual_dataset(name, layout)
        else:
            parts = [(str(path.with_name("raw.bin")), 0, h5py.h5f.UNLIMITED)]
            made = file.create_dataset(name, values.shape, values.dtype, external=parts)
            made[...] = values
        made.attrs.update({k: v for k, v in attributes.items() if "DIM" not in k})
        for axis, scale in zip(made.dims, scales, strict=True):
            if scale is not None:
                axis.attach_scale(scale)


@pytest.mark.parametrize("how", ["linked", "soft", "virtual", "external"])
@pytest.mark.parametrize("name", sorted(HELD))
def test_data_in_another_file_are_refused(name, how, sample, refused):
    """The lineage would name the file that leads there, and not the one that was read."""
    path, options = sample(name)
    _moved(path, HELD[name], how)

    message = refused(path, name, **options)

    assert "expected a file that holds its data itself, got" in message
    assert ("raw.bin" if how == "external" else "raw.h5") in message


def test_a_group_in_another_file_is_refused(sample, refused):
    """Whether the other file is there or not."""
    h5py = pytest.importorskip("h5py")
    path, options = sample("robofish")
    raw = path.with_name("raw.hdf5")
    path.rename(raw)
    for other in (raw.name, "gone.hdf5"):
        with h5py.File(raw) as source, h5py.File(path, "w") as file:
            file.attrs.update(source.attrs)
            file["samplings"] = h5py.ExternalLink(other, "/samplings")
            source.copy("entities", file)
        assert f"got /samplings in {other}" in refused(path, "robofish", **options)


def test_an_unknown_format_lists_the_known_ones_and_guesses(sample, refused):
    """Expected, got, and what the file looks like."""
    path, _ = sample("cats")

    message = refused(path, "catz")

    assert "Format 'catz' is unknown, expected one of csv, cats, trex" in message
    assert "looks like --format cats" in message


def test_a_wrong_format_is_told_which_one_it_looks_like(sample, refused):
    """A person gave --format csv for a file of the older rig."""
    path, _ = sample("cats")

    assert "looks like --format cats" in refused(path, "csv")


@pytest.mark.parametrize(
    ("name", "options"),
    [
        ("mot", {"keypoint": "head"}),
        ("csv", {"box": "centre"}),
        ("cats", {"first_frame": 1}),
        ("robofish", {"keypoint": "head"}),
        ("fishmodel", {"first_frame": 1}),
        ("sleap", {"columns": (("agent", "id"),)}),
        ("trex", {"body_axis": ("tail", "head")}),
    ],
)
def test_an_option_of_another_format_cannot_take_effect(name, options, sample, refused):
    """It is named, with those that the format takes."""
    path, scale = sample(name)

    message = refused(path, name, **scale, **options)

    assert f"{next(iter(options))} cannot take effect: format {name!r} takes" in message


@pytest.mark.parametrize("name", ["trex", "robofish", "fishmodel", "trajectorytools"])
def test_a_least_confidence_in_a_format_without_any_is_refused(name, sample, refused):
    """It could leave out nothing."""
    path, scale = sample(name)

    assert "min_confidence = 0.5 cannot take effect" in refused(
        path, name, **scale, min_confidence=0.5
    )


def test_a_file_that_is_not_there_is_named(tmp_path, refused):
    """Before anything else is looked at."""
    assert "gone.csv: no such file" in refused(tmp_path / "gone.csv", "csv")


def test_a_folder_is_read_by_trex_only(tmp_path, refused):
    """Others want one file."""
    assert "expected a file for format 'csv', got a folder" in refused(tmp_path, "csv")


@pytest.mark.parametrize(
    ("name", "package"),
    [
        ("sleap", "h5py"),
        ("idtracker", "h5py"),
        ("movement", "h5py"),
        ("nwb", "h5py"),
        ("robofish", "h5py"),
    ],
)
def test_a_missing_optional_package_is_named_with_its_extra(
    name, package, sample, refused, monkeypatch
):
    """h5py is no dependency; only the formats that are HDF5 need it."""
    path, options = sample(name)
    monkeypatch.setitem(sys.modules, package, None)

    message = refused(path, name, **options)

    assert f"needs the package {package!r}" in message
    assert "pip install 'zfcal[formats]'" in message


@pytest.mark.parametrize("name", NAMES)
def test_a_file_cut_short_anywhere_is_an_input_error_or_reads(name, sample, read):
    """Never a traceback: half a file is refused, or is whole rows of text."""
    path, options = sample(name)
    path = path / "tank_id1.npz" if path.is_dir() else path
    whole = path.read_bytes()

    for length in np.linspace(0, len(whole) - 1, 40).astype(int):
        path.write_bytes(whole[:length])
        try:
            tracks = read(path, name, **options).tracks
        except InputError:
            continue
        assert len(tracks) <= 7


@pytest.mark.parametrize("name", sorted(set(NAMES) - HDF5))
def test_a_file_with_other_bytes_is_an_input_error_or_reads(name, sample, read):
    """Bytes flipped at random: refused, or other numbers, but no other exception."""
    path, options = sample(name)
    path = path / "tank_id1.npz" if path.is_dir() else path
    whole = np.frombuffer(path.read_bytes(), dtype=np.uint8)
    rng = np.random.default_rng(1)

    for _ in range(60):
        broken = whole.copy()
        broken[rng.integers(0, len(whole), size=8)] = rng.integers(0, 256, size=8)
        path.write_bytes(broken.tobytes())
        try:
            read(path, name, **options)
        except InputError:
            continue


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"fps": 0.0}, "fps must be a positive rate in hertz, got 0.0"),
        ({"fps": float("nan")}, "fps must be"),
        ({"m_per_px": -1.0}, "m_per_px must be a positive number of metres per pixel, got -1.0"),
        ({"m_per_px": float("nan")}, "m_per_px must be"),
        ({"noise_m": float("nan")}, "noise_m must be a length in metres"),
        ({"origin": (0.0, float("inf"))}, "origin must be two finite numbers"),
        ({"n_fish": -1}, "n_fish must be a number of agents, got -1"),
        ({"min_confidence": 1.5}, "min_confidence must be 0 to 1, got 1.5"),
        ({"box": "middle"}, "box must be corner or centre, got 'middle'"),
        ({"flip_y": True}, "needs an origin"),
    ],
)
def test_options_are_checked_when_they_are_made(options, message):
    """A wrong option is told before a file is opened, NaN included."""
    with pytest.raises(InputError, match="(?s)" + message.replace("(", r"\(")):
        ImportOptions(**{"fps": 15.0, **options})
