"""Exported and imported again: what a format holds comes back, what it loses is told."""

import sys
from dataclasses import fields, replace

import numpy as np
import pytest

from zfcal.errors import InputError
from zfcal.readers import ImportOptions, import_foreign
from zfcal.tracks import GUESS, Tracks
from zfcal.writers import FORMATS, METRES, dense, export_files, lost

NAMES = sorted(FORMATS)
FPS = 15.0
POSITION_M = 1e-10


def same(found, tracks, names):
    """Compare columns: numbers as they were."""
    for name in names:
        np.testing.assert_array_equal(getattr(found, name), getattr(tracks, name), err_msg=name)


@pytest.mark.parametrize("name", NAMES)
def test_who_was_where_and_when_comes_back(name, tracks, round_trip):
    """Ids, kinds and frames as they were, gaps as gaps, places to 0.1 nm, with no option more."""
    found = round_trip(name, tracks).tracks
    same(found, tracks, ("frame", "agent", "kind"))
    np.testing.assert_allclose(found.time_s, tracks.time_s, atol=1e-12)
    np.testing.assert_allclose(found.x_m, tracks.x_m, rtol=0, atol=POSITION_M)
    np.testing.assert_allclose(found.y_m, tracks.y_m, rtol=0, atol=POSITION_M)


@pytest.mark.parametrize("name", NAMES)
def test_what_is_lost_is_what_is_told(name, tracks, round_trip):
    """A heading or a confidence that differs is named, and what is named differs."""
    found = round_trip(name, tracks).tracks
    told = " ".join(lost(dense(tracks, FPS), FORMATS[name].holds))
    kept = np.array_equal(found.heading_rad, tracks.heading_rad, equal_nan=True)
    assert ("headings are lost" in told) == (not kept)
    assert ("confidence" in told) == (not np.array_equal(found.confidence, tracks.confidence))


@pytest.mark.parametrize("name", NAMES)
def test_nothing_is_told_of_what_tracks_do_not_have(name, tracks, certain):
    """Certain positions without headings lose nothing but, in two formats, the rate."""
    told = list(lost(dense(certain(tracks), FPS), FORMATS[name].holds))
    assert [line for line in told if "frame rate" not in line] == []
    assert len(told) == (name in {"deeplabcut", "sleap"})


def test_a_guess_stays_a_guess_in_idtracker(tracks, round_trip):
    """Certainty of one half and more as it was, less comes back as 0.4."""
    found = round_trip("idtracker", tracks).tracks
    guess = tracks.confidence < GUESS
    assert guess.any()
    np.testing.assert_array_equal(found.confidence[~guess], tracks.confidence[~guess])
    np.testing.assert_allclose(found.confidence[guess], 0.4)


def test_movement_in_pixels_has_headings_in_the_images_sense(tracks, round_trip):
    """Mirrored on the way out and on the way in: the same."""
    found = round_trip("movement", tracks, scaled=True).tracks
    np.testing.assert_allclose(found.heading_rad, tracks.heading_rad, atol=1e-6)
    np.testing.assert_allclose(found.y_m, tracks.y_m, rtol=0, atol=POSITION_M)


def test_movement_in_metres_is_not_called_mirrored(tracks, round_trip):
    """The file says that its y goes up."""
    assert not any("mirrored" in note for note in round_trip("movement", tracks).notes)


def test_the_csv_of_deeplabcut_holds_what_its_hdf5_does(tracks, image, tmp_path):
    """Both are read to the same tracks."""
    axes = image.axes("px")
    for file, write in export_files("deeplabcut", dense(tracks, FPS), axes, image).items():
        write(tmp_path / file)
    options = ImportOptions(fps=FPS, m_per_px=axes.m_per_unit)
    one, other = (
        import_foreign(tmp_path / f"tracksDLC_zfcal.{ending}", "deeplabcut", options).tracks
        for ending in ("csv", "h5")
    )
    same(one, other, [field.name for field in fields(Tracks)])


def test_the_arrays_of_trex_by_hand(tracks, image, tmp_path):
    """From an individual's first frame to its last, in cm; missing and infinite where lost."""
    files = export_files("trex", dense(tracks, FPS), image.axes("cm"), image)
    names = ["tracks_fish2.npz", "tracks_fish5.npz", "tracks_fish7.npz", "tracks_robot11.npz"]
    assert list(files) == names
    for name in names[1:3]:
        files[name](tmp_path / name)
    five, seven = (np.load(tmp_path / name) for name in names[1:3])
    lost = [*range(10, 15), 20]
    assert five["frame"].tolist() == list(range(2, 40))
    assert five["frame"][five["missing"] == 1].tolist() == lost
    assert five["frame"][np.isinf(five["X#wcentroid"])].tolist() == lost
    assert seven["frame"][0] == 9
    row = np.flatnonzero((tracks.agent == 7) & (tracks.frame == 9))[0]
    assert seven["Y#wcentroid"][0] == pytest.approx(102 - 100 * tracks.y_m[row])
    assert (seven["id"].item(), seven["frame_rate"].item()) == (7, FPS)
    assert seven["cm_per_pixel"].item() == pytest.approx(0.08)


@pytest.mark.parametrize("name", ["trex", "movement"])
def test_uneven_times_come_back_where_there_is_a_place_for_them(name, tracks, round_trip):
    """A camera's own times, up to 5 ms late."""
    late_s = 0.005 * np.sin(tracks.frame)
    uneven = replace(tracks, time_s=tracks.time_s + late_s)
    found = round_trip(name, uneven).tracks
    np.testing.assert_allclose(found.time_s, uneven.time_s, atol=1e-12)
    assert not any(
        "times are lost" in line for line in lost(dense(uneven, FPS), FORMATS[name].holds)
    )


@pytest.mark.parametrize("name", ["deeplabcut", "idtracker", "sleap"])
def test_uneven_times_are_told_where_there_is_none(name, tracks, round_trip):
    """They come back as frame / fps, and the line says how far off that is."""
    uneven = replace(tracks, time_s=tracks.time_s + np.where(tracks.frame == 30, 0.004, 0.0))
    found = round_trip(name, uneven).tracks
    np.testing.assert_allclose(found.time_s, found.frame / FPS)
    told = [line for line in lost(dense(uneven, FPS), FORMATS[name].holds) if "times" in line]
    assert "4 ms off frame / fps" in told[0]


@pytest.mark.parametrize("name", NAMES)
def test_the_same_tracks_give_the_same_bytes(name, tracks, image, tmp_path):
    """No clock and no chance is in a file."""
    axes = FORMATS[name].axes(image, scaled=False)
    for file, write in export_files(name, dense(tracks, FPS), axes, image).items():
        pair = [tmp_path / f"{which}-{file}" for which in ("one", "two")]
        for path in pair:
            write(path)
        assert pair[0].read_bytes() == pair[1].read_bytes()


@pytest.mark.parametrize(
    ("name", "module"), [("sleap", "h5py"), ("deeplabcut", "h5py"), ("movement", "xarray")]
)
def test_a_package_that_is_missing_is_named(name, module, tracks, image, monkeypatch):
    """With the extra that brings it."""
    monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(InputError, match=f"needs the package '{module}'") as caught:
        export_files(name, dense(tracks, FPS), METRES, image)
    assert "zfcal[formats]" in caught.value.hint


def test_an_unknown_format_is_refused(tracks, image):
    """And the known ones are listed."""
    with pytest.raises(InputError, match="expected one of trex, idtracker"):
        export_files("ctrax", dense(tracks, FPS), METRES, image)
