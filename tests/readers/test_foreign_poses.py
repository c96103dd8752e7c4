"""SLEAP, DeepLabCut and movement: body parts, axes and layouts."""

import sys

import numpy as np
import pytest

PX = 0.001


def _sleap(path, tracks, names=(b"blue", b"red"), nodes=(b"head", b"tail"), **attributes):
    h5py = pytest.importorskip("h5py")
    with h5py.File(path, "w") as file:
        file["tracks"] = tracks
        file["track_names"] = np.array(names, dtype="S8")
        file["node_names"] = np.array(nodes, dtype="S8")
        file["tracks"].attrs.update(attributes)
    return path


@pytest.fixture
def parts():
    """Return positions (frame, agent, part, xy): head 20 px right of and 10 px above the tail."""
    tail = np.array([[[100.0, 200.0], [300.0, 400.0]], [[110.0, 200.0], [300.0, 390.0]]])
    return np.stack([tail + np.array([20.0, -10.0]), tail], axis=2)


@pytest.fixture
def sleap_file(tmp_path, parts):
    """Return a SLEAP file in the order in which SLEAP stores it."""
    return _sleap(tmp_path / "a.h5", parts.transpose(1, 3, 2, 0))


def test_several_parts_must_be_chosen_from(sleap_file, refused):
    """All names are listed, with an example."""
    message = refused(sleap_file, "sleap", m_per_px=PX)

    assert "there are several body parts, expected one of them as the position: head, tail" in (
        message
    )
    assert "--keypoint head" in message


def test_a_part_is_taken_by_its_name(sleap_file, read):
    """The head of blue is at (120, 190) px."""
    imported = read(sleap_file, "sleap", m_per_px=PX, keypoint="head")

    assert imported.tracks.x_m[:2] == pytest.approx([0.12, 0.32])
    assert imported.tracks.y_m[:2] == pytest.approx([0.19, 0.39])
    assert "Agents are numbered: blue = 0, red = 1." in imported.notes


def test_the_mean_of_parts_needs_all_of_them(tmp_path, parts, read):
    """(120 + 100) / 2 by hand; a frame with one part lost has no mean."""
    parts[1, 0, 1] = np.nan
    path = _sleap(tmp_path / "a.h5", parts.transpose(1, 3, 2, 0))

    tracks = read(path, "sleap", m_per_px=PX, keypoint="mean").tracks

    assert tracks.x_m[0] == pytest.approx(0.11)
    assert tracks.agent.tolist() == [0, 1, 1]


def test_a_body_axis_gives_the_heading_in_image_and_in_tank(sleap_file, read):
    """Head right of and above the tail: -0.4636 rad with y down, +0.4636 with y up."""
    axis = {"keypoint": "head", "body_axis": ("tail", "head")}

    down = read(sleap_file, "sleap", m_per_px=PX, **axis).tracks
    up = read(sleap_file, "sleap", m_per_px=PX, **axis, flip_y=True, origin=(0.0, 500.0)).tracks

    assert down.heading_rad == pytest.approx([np.arctan2(-10, 20)] * 4)
    assert up.heading_rad == pytest.approx([np.arctan2(10, 20)] * 4)


def test_a_part_that_is_not_there_lists_those_that_are(sleap_file, refused):
    """For the position and for the body axis."""
    for wrong in ({"keypoint": "fin"}, {"keypoint": "head", "body_axis": ("tail", "fin")}):
        assert "no body part is called 'fin', expected one of head, tail" in refused(
            sleap_file, "sleap", m_per_px=PX, **wrong
        )


def test_sleap_io_says_in_which_order_it_stores(tmp_path, parts, read, attributes):
    """The attribute dims goes before SLEAP's own order."""
    order = attributes(["frame", "track", "node", "xy"])
    path = _sleap(tmp_path / "a.h5", parts, dims=order)

    assert read(path, "sleap", m_per_px=PX, keypoint="tail").tracks.x_m[:2] == pytest.approx(
        [0.1, 0.3]
    )


def test_arrays_in_another_order_are_refused(tmp_path, parts, refused, attributes):
    """(frame, track, node, xy) without dims would be read as (track, xy, node, frame)."""
    plain = _sleap(tmp_path / "a.h5", np.repeat(parts, 3, axis=0))
    other = _sleap(tmp_path / "b.h5", parts, dims=attributes(["t", "id", "node", "xy"]))

    assert "expected tracks of shape (track, 2, node, frame)" in refused(
        plain, "sleap", m_per_px=PX, keypoint="tail"
    )
    assert "expected dims of track, xy, node, frame, got t, id, node, xy" in refused(
        other, "sleap", m_per_px=PX, keypoint="tail"
    )


def test_a_sleap_file_without_track_names_is_one_animal(tmp_path, parts, read):
    """Single-instance projects have no tracks."""
    path = _sleap(tmp_path / "a.h5", parts[:, :1].transpose(1, 3, 2, 0), names=())

    assert set(read(path, "sleap", m_per_px=PX, keypoint="tail").tracks.agent.tolist()) == {0}


def test_a_project_file_is_no_analysis_file(tmp_path, refused):
    """.slp files are HDF5 as well, but hold no tracks."""
    h5py = pytest.importorskip("h5py")
    path = tmp_path / "a.h5"
    with h5py.File(path, "w") as file:
        file["points"] = np.zeros(3)

    assert "expected a data set 'tracks', got points" in refused(path, "sleap", m_per_px=PX)


@pytest.mark.parametrize("layout", ["table", "fixed"])
def test_hdf5_of_deeplabcut_as_pandas_wrote_it(layout, golden, read):
    """Both layouts of pandas (3.1, PyTables 3.11); counted up from 0 column by column."""
    path = golden(f"deeplabcut-several-{layout}.h5")

    imported = read(path, "deeplabcut", m_per_px=PX, keypoint="head")
    tracks = imported.tracks

    assert tracks.frame.tolist() == [0, 0, 1, 1, 2, 3, 3]
    assert tracks.x_m * 1000 == pytest.approx([0, 6, 12, 18, 24, 36, 42])
    assert tracks.y_m * 1000 == pytest.approx([1, 7, 13, 19, 25, 37, 43])
    assert tracks.confidence == pytest.approx([0.9, 0.9, 0.8, 0.8, 0.2, 1.0, 1.0])
    assert "Agents are numbered: blue = 0, red = 1." in imported.notes


def test_hdf5_of_deeplabcut_with_one_animal(golden, read):
    """No level of individuals."""
    path = golden("deeplabcut-one-table.h5")

    tracks = read(path, "deeplabcut", m_per_px=PX, keypoint="tail", min_confidence=0.5).tracks

    assert tracks.frame.tolist() == [0, 1, 3]
    assert tracks.x_m * 1000 == pytest.approx([3, 9, 21])


def test_hdf5_of_deeplabcut_runs_no_pickle(golden, refused, tmp_path):
    """PyTables would run what stands in the attribute; here it is refused."""
    h5py = pytest.importorskip("h5py")
    path = golden("deeplabcut-one-table.h5")
    marker = tmp_path / "it-ran"
    with h5py.File(path, "r+") as file:
        attributes = file["df_with_missing/table"].attrs
        attributes["values_block_0_kind"] = np.bytes_(
            f"cos\nsystem\n(S'touch {marker}'\ntR.".encode()
        )

    message = refused(path, "deeplabcut", m_per_px=PX, keypoint="tail")

    assert "it refers to os.system" in message
    assert not marker.exists()


def test_csv_of_deeplabcut_with_one_animal_by_hand(write, read):
    """Three header lines; an empty cell is missing."""
    path = write(
        "a.csv",
        "scorer,net,net,net\nbodyparts,body,body,body\ncoords,x,y,likelihood\n"
        "0,100,200,0.9\n1,,,\n2,120,200,0.4\n",
    )

    tracks = read(path, "deeplabcut", m_per_px=PX).tracks

    assert tracks.frame.tolist() == [0, 2]
    assert tracks.confidence == pytest.approx([0.9, 0.4])


def test_parts_of_no_animal_are_passed_over(write, read):
    """Corners of the tank stand under the individual 'single'."""
    path = write(
        "a.csv",
        "scorer,net,net,net,net\nindividuals,blue,blue,single,single\n"
        "bodyparts,body,body,corner,corner\ncoords,x,y,x,y\n0,100,200,0,0\n",
    )

    imported = read(path, "deeplabcut", m_per_px=PX)

    assert imported.tracks.x_m.tolist() == [0.1]
    assert any("individual 'single'" in note for note in imported.notes)


WRONG_DLC = {
    "other head": ("time_s,agent,x_m,y_m\n0,0,1,2\n", "expected lines that start with scorer"),
    "training data": (
        "scorer,n,n\nbodyparts,b,b\ncoords,x,y\nlabeled-data/v/img1.png,1,2\n",
        "line 4, column frame: expected a number, got 'labeled-data/v/img1.png'",
    ),
    "in space": (
        "scorer,n,n,n\nbodyparts,b,b,b\ncoords,x,y,z\n0,1,2,3\n",
        "expected poses in two dimensions",
    ),
    "backwards": ("scorer,n,n\nbodyparts,b,b\ncoords,x,y\n1,1,2\n0,1,2\n", "numbers that ascend"),
    "head only": ("scorer,n,n\nbodyparts,b,b\ncoords,x,y\n", "a header but no row"),
    "word": (
        "scorer,n,n\nbodyparts,b,b\ncoords,x,y\n0,1,2\n1,x,2\n",
        "line 5, column n/b/x: expected a number, got 'x'",
    ),
}


@pytest.mark.parametrize("case", WRONG_DLC)
def test_a_wrong_csv_of_deeplabcut_is_one_clear_line(case, write, refused):
    """With the line in the file, header lines counted."""
    text, expected = WRONG_DLC[case]

    assert expected in refused(write("a.csv", text), "deeplabcut", m_per_px=PX)


def _movement(path, dims=("time", "space", "keypoint", "individual"), **attributes):
    xarray = pytest.importorskip("xarray")
    pytest.importorskip("h5netcdf")
    position = xarray.DataArray(
        np.arange(6.0).reshape(3, 1, 1, 2) + np.array([100.0, 200.0]).reshape(1, 2, 1, 1),
        dims=("time", "space", "keypoint", "individual"),
        coords={
            "time": [0, 1, 2],
            "space": attributes.pop("space", ["x", "y"]),
            "keypoint": ["c"],
            "individual": ["a", "b"],
        },
        attrs={k: v for k, v in attributes.items() if k == "space_unit"},
    )
    singular = {dim.removesuffix("s"): dim for dim in dims}
    position = position.isel({dim: 0 for dim in position.dims if dim not in singular}, drop=True)
    data = xarray.Dataset(
        {"position": position.transpose(*singular).rename(singular)},
        attrs={k: v for k, v in attributes.items() if k != "space_unit"},
    )
    data.to_netcdf(path, engine="h5netcdf")
    return path


@pytest.mark.parametrize(
    "dims",
    [
        ("time", "space", "keypoint", "individual"),
        ("time", "space", "keypoints", "individuals"),
        ("individual", "keypoint", "time", "space"),
        ("time", "space", "individuals"),
    ],
)
def test_movement_before_and_since_its_dimensions_are_singular(dims, tmp_path, read):
    """And boxes, which have no keypoints; times in frames."""
    path = _movement(tmp_path / "a.nc", dims, time_unit="frames")

    imported = read(path, "movement", m_per_px=PX)

    assert imported.tracks.x_m * 1000 == pytest.approx([100, 101, 102, 103, 104, 105])
    assert imported.tracks.y_m * 1000 == pytest.approx([200, 201, 202, 203, 204, 205])
    assert imported.tracks.time_s == pytest.approx(np.repeat([0, 1, 2], 2) / 15)
    assert "Agents are numbered: a = 0, b = 1." in imported.notes


def test_movement_can_state_its_unit(tmp_path, read, refused):
    """Centimetres by movement's own scale: no scale is needed, and none can be given."""
    path = _movement(tmp_path / "a.nc", time_unit="frames", space_unit="cm")

    assert read(path, "movement").tracks.x_m[0] == pytest.approx(1.0)
    assert "cannot take effect" in refused(path, "movement", m_per_px=PX)


WRONG_MOVEMENT = {
    "unit": ({"space_unit": "furlong"}, "positions are in 'furlong', expected one of px"),
    "time unit": ({"time_unit": "minutes"}, "expected time_unit frames or seconds, got 'minutes'"),
    "rate": ({"time_unit": "frames", "fps": 30.0}, "states 30 frames per second, expected"),
    "rate in words": ({"time_unit": "frames", "fps": "fast"}, "a frame rate in fps, got 'fast'"),
    "other axes": ({"dims": ("time", "space")}, "expected a variable 'position' over time"),
    "rows and columns": ({"space": ["row", "col"]}, "expected space to be x, y, got row, col"),
}


@pytest.mark.parametrize("case", WRONG_MOVEMENT)
def test_a_wrong_movement_file_is_one_clear_line(case, tmp_path, refused):
    """Expected and got."""
    changes, expected = WRONG_MOVEMENT[case]
    path = _movement(tmp_path / "a.nc", **changes)

    assert expected in refused(path, "movement", m_per_px=PX)


def test_packed_netcdf_is_refused(tmp_path, refused):
    """Whole numbers with a factor would be read as pixels."""
    h5py = pytest.importorskip("h5py")
    path = _movement(tmp_path / "a.nc", time_unit="frames")
    with h5py.File(path, "r+") as file:
        file["position"].attrs["scale_factor"] = 0.1

    assert "expected plain numbers in position, got float64 packed by scale_factor" in refused(
        path, "movement", m_per_px=PX
    )


def test_confidence_over_other_axes_is_refused(tmp_path, refused):
    """It must go with the positions."""
    xarray = pytest.importorskip("xarray")
    path = _movement(tmp_path / "a.nc", time_unit="frames")
    data = xarray.load_dataset(path, engine="h5netcdf")
    data["confidence"] = ("time", np.ones(3))
    data.to_netcdf(tmp_path / "b.nc", engine="h5netcdf")

    assert "expected confidence over {'time': 3, 'keypoint': 1, 'individual': 2}, got" in refused(
        tmp_path / "b.nc", "movement", m_per_px=PX
    )


def test_agents_that_are_called_by_kind_and_number_get_both(tmp_path, parts, read):
    """``robot_7`` is robot 7, if all are called so; else they are numbered as ever."""
    path = tmp_path / "named.h5"
    _sleap(path, parts.transpose(1, 3, 2, 0), names=(b"fish_3", b"robot_7"))
    found = read(path, "sleap", m_per_px=PX, keypoint="head").tracks
    assert set(zip(found.agent.tolist(), found.kind.tolist(), strict=True)) == {(3, 0), (7, 1)}
    _sleap(path, parts.transpose(1, 3, 2, 0), names=(b"fish_3", b"shark_7"))
    found = read(path, "sleap", m_per_px=PX, keypoint="head").tracks
    assert set(zip(found.agent.tolist(), found.kind.tolist(), strict=True)) == {(0, 0), (1, 0)}


def test_headings_of_movement_over_other_axes_are_refused(tmp_path, refused):
    """They go with the positions, one for each individual and time."""
    h5py = pytest.importorskip("h5py")
    path = _movement(tmp_path / "tank.nc")
    with h5py.File(path, "r+") as file:
        file["heading_rad"] = np.zeros(3)
    assert "expected heading_rad" in refused(path, "movement", m_per_px=PX)


def test_labels_of_sleap_without_sleap_io_say_what_to_install(write, refused, monkeypatch):
    """The one line names the package and the extra that brings it."""
    monkeypatch.setitem(sys.modules, "sleap_io", None)

    message = refused(write("tank.slp", "labels"), "sleap", m_per_px=PX)

    assert "tank.slp: reading this format needs the package 'sleap-io'" in message
    assert "pip install 'zfcal[sleap]'" in message
