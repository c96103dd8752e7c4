"""Two fish in four frames, written in every format that zfcal reads.

Blue swims right at 10 mm a frame from (0.10, 0.20) m; red swims down from
(0.30, 0.40) m and is missing in frame 2. One pixel is one millimetre.
"""

import gzip
import json
from pathlib import Path

import numpy as np
import pytest

from zfcal.errors import InputError
from zfcal.readers import ImportOptions, import_foreign

FPS = 15.0
PX = 0.001
GOLDEN = Path(__file__).parent / "golden"

XY_PX = np.array(
    [
        [[100.0, 200.0], [300.0, 400.0]],
        [[110.0, 200.0], [300.0, 390.0]],
        [[120.0, 200.0], [np.nan, np.nan]],
        [[130.0, 200.0], [300.0, 370.0]],
    ]
)
"""Positions, shape (frame, agent, xy)."""


@pytest.fixture
def xy_px():
    """Return the positions of the two fish, shape (frame, agent, xy), in pixels."""
    return XY_PX.copy()


@pytest.fixture
def write(tmp_path):
    """Return what writes a text file into the test's own folder."""

    def writer(name, text):
        path = tmp_path / name
        if name.endswith(".gz"):
            path.write_bytes(gzip.compress(text.encode()))
        else:
            path.write_text(text, encoding="utf-8")
        return path

    return writer


@pytest.fixture
def read():
    """Return what imports a file at 15 Hz, with other options if they are given."""

    def reader(path, name, **options):
        return import_foreign(path, name, ImportOptions(**{"fps": FPS, **options}))

    return reader


@pytest.fixture
def refused(read):
    """Return what imports a file that must be refused; gives the message with its hint."""

    def refuser(path, name, **options):
        with pytest.raises(InputError) as caught:
            read(path, name, **options)
        message = str(caught.value)
        assert "\n" not in message
        return f"{message} {caught.value.hint}".strip()

    return refuser


@pytest.fixture
def golden(tmp_path):
    """Return what unpacks a file that another program wrote."""

    def unpacker(name):
        path = tmp_path / name
        path.write_bytes(gzip.decompress((GOLDEN / f"{name}.gz").read_bytes()))
        return path

    return unpacker


def _csv(path):
    lines = ["time_s,agent,x_m,y_m"]
    for k, frame in enumerate(XY_PX / 1000):
        lines += [f"{k / FPS!r},{agent},{x},{y}" for agent, (x, y) in enumerate(frame)]
    path.write_text("\n".join(lines) + "\n")


def _cats(path):
    parts = ("X", "Y", "Direction")
    lines = ["\t".join(["timeStep", *(f"fish{i}{part}" for i in (0, 1) for part in parts), ""])]
    for k, frame in enumerate(XY_PX / 1000):
        cells = [f"{7 + k / FPS:.3f}"]
        for x, y in frame:
            cells += [f"{x}", f"{y}", "0.5"] if np.isfinite(x) else ["NaN"] * 3
        lines.append("\t".join([*cells, ""]))
    path.write_text("\n".join(lines) + "\n")


def _trex(path):
    path.mkdir()
    for agent in (0, 1):
        x, y = XY_PX[:, agent].T / 10
        lost = np.isnan(x)
        columns = {
            "frame": np.arange(4.0),
            "time": np.arange(4) / FPS,
            "missing": lost.astype(float),
            "X#wcentroid": np.where(lost, np.inf, x),
            "Y#wcentroid": np.where(lost, np.inf, y),
        }
        np.savez(path / f"tank_id{agent}.npz", **columns)


def _idtracker(path):
    h5py = pytest.importorskip("h5py")
    with h5py.File(path, "w") as file:
        file.create_dataset("trajectories", data=XY_PX, compression="gzip")
        file.create_dataset("id_probabilities", data=np.ones((4, 2)))
        file.attrs["frames_per_second"] = 15
        file.attrs["length_unit"] = -1
        file.attrs["identities_labels"] = ["0", "1"]


def _trajectorytools(path):
    np.save(path, {"trajectories": XY_PX, "frames_per_second": 15}, allow_pickle=True)


def _mot(path):
    lines = []
    for k, frame in enumerate(XY_PX):
        for agent, (x, y) in enumerate(frame):
            if np.isfinite(x):
                lines.append(f"{k + 1},{agent},{x - 20},{y - 5},40,10,1")
    path.write_text("\n".join(lines) + "\n")


def _sleap(path):
    h5py = pytest.importorskip("h5py")
    with h5py.File(path, "w") as file:
        # (track, xy, node, frame), as SLEAP writes it.
        file.create_dataset("tracks", data=XY_PX.transpose(1, 2, 0)[:, :, np.newaxis])
        file.create_dataset("point_scores", data=np.full((2, 1, 4), 0.9))
        file.create_dataset("track_occupancy", data=np.ones((4, 2), dtype=np.uint8))
        file.create_dataset("track_names", data=[b"0", b"1"])
        file.create_dataset("node_names", data=[b"body"])


def _deeplabcut(path):
    heads = {
        "scorer": ["net"] * 6,
        "individuals": ["0"] * 3 + ["1"] * 3,
        "bodyparts": ["body"] * 6,
        "coords": ["x", "y", "likelihood"] * 2,
    }
    lines = [",".join([name, *cells]) for name, cells in heads.items()]
    for k, frame in enumerate(XY_PX):
        cells = [f"{x},{y},0.9" if np.isfinite(x) else ",," for x, y in frame]
        lines.append(f"{k},{','.join(cells)}")
    path.write_text("\n".join(lines) + "\n")


def _movement(path):
    xarray = pytest.importorskip("xarray")
    data = xarray.Dataset(
        {
            "position": (
                ("time", "space", "keypoints", "individuals"),
                XY_PX.transpose(0, 2, 1)[:, :, np.newaxis],
            ),
            "confidence": (("time", "keypoints", "individuals"), np.ones((4, 1, 2))),
        },
        coords={
            "time": np.arange(4) / FPS,
            "space": ["x", "y"],
            "keypoints": ["centroid"],
            "individuals": ["0", "1"],
        },
        attrs={"fps": FPS, "time_unit": "seconds", "ds_type": "poses"},
    )
    data.to_netcdf(path, engine="h5netcdf")


def nwb_series(group, xy_px, part="body", *, confidence=0.9, rate_hz=None, time_s=None):
    """Write a body part of an animal as ndx-pose does, with a rate from 0 on or with times."""
    node = group.create_group(part)
    node.attrs["neurodata_type"] = "PoseEstimationSeries"
    node["data"] = xy_px
    node["data"].attrs["unit"] = "pixels"
    node["confidence"] = np.full(len(xy_px), confidence)
    if rate_hz is not None:
        node["starting_time"] = 0.0 if time_s is None else time_s
        node["starting_time"].attrs["rate"] = rate_hz
    elif time_s is not None:
        node["timestamps"] = time_s


def nwb_animal(file, name, module="SLEAP_VIDEO_000_tank", video="tank.mp4"):
    """Make the group of an animal."""
    group = file.create_group(f"processing/{module}/track={name}")
    group.attrs["neurodata_type"] = "PoseEstimation"
    group["original_videos"] = [video.encode()]
    return group


def _nwb(path):
    h5py = pytest.importorskip("h5py")
    with h5py.File(path, "w") as file:
        file["file_create_date"] = [b"2026-01-01T00:00:00+00:00"]
        nwb_series(nwb_animal(file, "0"), XY_PX[:, 0], rate_hz=15.0)
        seen = ~np.isnan(XY_PX[:, 1, 0])
        times = {"time_s": np.arange(4)[seen] / FPS}
        nwb_series(nwb_animal(file, "1"), XY_PX[seen, 1], **times)


@pytest.fixture
def nwb():
    """Return what writes animals and their body parts into an open NWB file."""
    return nwb_animal, nwb_series


def _robofish(path):
    h5py = pytest.importorskip("h5py")
    with h5py.File(path, "w") as file:
        file.attrs["format_version"] = np.array([1, 0], dtype=np.int32)
        file.attrs["world_size_cm"] = np.array([100.0, 100.0], dtype=np.float32)
        file.create_group("samplings/15 hz").attrs["frequency_hz"] = np.float32(15)
        file["samplings"].attrs["default"] = "15 hz"
        for name, xy_px in zip("01", XY_PX.transpose(1, 0, 2), strict=True):
            entity = file.create_group(f"entities/{name}")
            entity.attrs["category"] = "organism"
            entity.create_dataset("positions", data=(xy_px / 10).astype(np.float32))
            entity.create_dataset("orientations", data=np.full((4, 2), [0, 1], dtype=np.float32))


def _fishmodel(path):
    lines = []
    for k, frame in enumerate(XY_PX / 1000):
        cells = [f"{x} {y} 0.5" if np.isfinite(x) else "nan nan nan" for x, y in frame]
        lines.append("\t".join([f"{k / 15:.6f}", *cells]))
    path.write_text("\n".join(lines) + "\n")


WRITERS = {
    "csv": ("tracks.csv", _csv),
    "cats": ("positions-1.txt", _cats),
    "trex": ("data", _trex),
    "idtracker": ("trajectories.h5", _idtracker),
    "trajectorytools": ("trajectories.npy", _trajectorytools),
    "mot": ("gt.csv", _mot),
    "sleap": ("tank.analysis.h5", _sleap),
    "deeplabcut": ("tankDLC.csv", _deeplabcut),
    "movement": ("tank.nc", _movement),
    "nwb": ("tank.nwb", _nwb),
    "robofish": ("tank.hdf5", _robofish),
    "fishmodel": ("printed.txt", _fishmodel),
}

METRIC = {"csv", "cats", "trex", "robofish", "fishmodel"}
"""Samples that are in metres or centimetres, and take no scale."""


@pytest.fixture
def sample(tmp_path):
    """Return what writes the two fish in a format, and gives the path and its options."""

    def writer(name):
        file, write_file = WRITERS[name]
        path = tmp_path / file
        write_file(path)
        return path, ({} if name in METRIC else {"m_per_px": PX})

    return writer


@pytest.fixture
def attributes():
    """Return what writes JSON text, as sleap-io does into attributes."""
    return json.dumps
