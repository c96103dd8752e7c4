"""Real recordings: converted, imported and analysed; their tables are those of their numbers."""

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import shapely

from zfcal.artifacts.arenas import arena_of, load_arena
from zfcal.artifacts.segments import segment_path
from zfcal.artifacts.tables import read_table, read_tracks
from zfcal.errors import InputError
from zfcal.stages.analyse.analyse import AnalyseOptions, analyse
from zfcal.stages.events import LeftOut, Note, say_nothing
from zfcal.stages.import_ import Source, import_tracks
from zfcal.stages.init import NewTrial, create_trial
from zfcal.tracks import FISH, ROBOT

PX_PER_M = 1024 / 1.11


@pytest.fixture(scope="module")
def ring(scripts):
    """Return the module that knows the ring."""
    return scripts("ring")


@pytest.fixture(scope="module")
def recordings(scripts):
    """Return the module that knows all recordings."""
    return scripts("recordings")


@pytest.fixture(scope="module")
def document(scripts):
    """Return the module that writes the tables."""
    return scripts("real_document")


def swim(rng, n, *, inner_m=0.20, outer_m=0.285):
    """Return positions in metres spread over a ring about (0.57, 0.53), shape (n, 2)."""
    radius = np.sqrt(rng.uniform(inner_m**2, outer_m**2, n))
    angle = rng.uniform(-np.pi, np.pi, n)
    return np.column_stack([0.57 + radius * np.cos(angle), 0.53 + radius * np.sin(angle)])


def write_npz(path, xy_px, guessed, **more):
    """Write positions in pixels, NaN where missing, as the published arrays are."""
    decipx = np.where(np.isnan(xy_px), -32768, np.round(10 * xy_px)).astype(np.int16)
    np.savez(path, pos_decipx=decipx, estimated=np.packbits(guessed, axis=0), **more)
    return path


def test_a_ring_file_is_read_as_it_was_written(ring, tmp_path):
    """Tenths of pixels become pixels, -32768 NaN, and packed bits the guessed positions."""
    xy_px = np.array([[[10.5, 20.0], [30.0, 40.2]], [[11.5, 21.0], [np.nan, np.nan]]])
    guessed = np.array([[False, True], [False, True]])
    path = write_npz(tmp_path / "run.npz", xy_px, guessed, robot_index=np.int64(1))

    run = ring.read_ring(path)

    np.testing.assert_allclose(run.xy_px, xy_px)
    np.testing.assert_array_equal(run.guessed, guessed)
    assert (run.robot, run.n_fish) == (1, 1)
    assert run.duration_s == pytest.approx(2 / 15)


def test_a_ring_of_fish_alone_has_no_robot(ring, tmp_path):
    """The index -1 is no column."""
    path = write_npz(
        tmp_path / "run.npz", np.ones((9, 3, 2)), np.zeros((9, 3), bool), robot_index=np.int64(-1)
    )

    run = ring.read_ring(path)

    assert (run.robot, run.n_fish, run.guessed.shape) == (None, 3, (9, 3))


def test_another_npz_is_refused_by_name(ring, tmp_path):
    """The message names the file and what it should hold."""
    np.savez(tmp_path / "other.npz", x=np.ones(3))

    with pytest.raises(InputError, match=r"other.npz: expected arrays pos_decipx and estimated"):
        ring.read_ring(tmp_path / "other.npz")


def test_the_csv_has_a_row_per_position_and_doubts_what_was_guessed(ring, tmp_path):
    """A missing position has no row, a guessed one a confidence below one half."""
    xy_px = np.array([[[10.5, 20.0], [30.0, 40.0]], [[np.nan, np.nan], [31.0, 41.0]]])
    run = ring.RingRun(xy_px=xy_px, guessed=np.array([[True, False], [False, False]]), robot=1)

    ring.write_csv(run, tmp_path / "run.csv")

    table = pd.read_csv(tmp_path / "run.csv")
    assert list(table.columns) == ["frame", "agent", "kind", "x_px", "y_px", "confidence"]
    assert table.to_numpy().tolist() == [
        [0, 0, "fish", 10.5, 20.0, 0.1],
        [0, 1, "robot", 30.0, 40.0, 1.0],
        [1, 1, "robot", 31.0, 41.0, 1.0],
    ]
    assert ring.GUESSED < 0.5


def test_the_ring_is_found_although_nobody_swims_at_a_third_of_its_outer_wall(ring):
    """Centre and radii within a millimetre: half a pixel, with guesses across the hole."""
    rng = np.random.default_rng(3)
    xy_m = swim(rng, 60_000)
    away = xy_m - [0.57, 0.53]
    lazy = (np.abs(np.arctan2(away[:, 1], away[:, 0])) < np.pi / 3) & (np.hypot(*away.T) > 0.25)
    xy_m = xy_m[~lazy]
    guesses_m = rng.uniform([0.4, 0.3], [0.9, 0.8], (len(xy_m) // 4, 2))
    xy_px = np.concatenate([xy_m, guesses_m])[:, None] * PX_PER_M
    guessed = (np.arange(len(xy_px)) >= len(xy_m))[:, None]

    found = ring.fit_ring(ring.RingRun(xy_px=xy_px, guessed=guessed, robot=None))

    np.testing.assert_allclose(np.array(found.centre_px) / PX_PER_M, [0.57, 0.53], atol=1e-3)
    assert found.inner_m == pytest.approx(0.20, abs=1e-3)
    assert found.outer_m == pytest.approx(0.285, abs=1e-3)


def test_a_shifted_camera_shifts_the_centre_and_nothing_else(ring):
    """Ten pixels to the right and five down."""
    xy_px = swim(np.random.default_rng(4), 20_000)[:, None] * PX_PER_M
    guessed = np.zeros((len(xy_px), 1), bool)

    one, other = (
        ring.fit_ring(ring.RingRun(xy_px=points, guessed=guessed, robot=None))
        for points in (xy_px, np.add(xy_px, (10.0, 5.0)))
    )

    np.testing.assert_allclose(np.subtract(other.centre_px, one.centre_px), [10, 5], atol=0.05)
    assert other.outer_m - other.inner_m == pytest.approx(one.outer_m - one.inner_m, abs=1e-4)


def test_a_ring_needs_points_all_round(ring):
    """A fish that stays in one corner does not tell where the ring is."""
    xy_px = np.random.default_rng(5).normal(500.0, 1.0, (5000, 1, 2))
    xy_px[:40] += [0.0, 300.0]

    run = ring.RingRun(xy_px=xy_px[:50], guessed=np.zeros((50, 1), bool), robot=None)

    with pytest.raises(InputError, match="needs at least 100 points, got 50"):
        ring.fit_ring(run)


def test_each_column_says_how_often_it_was_guessed_and_was_in_the_middle(ring):
    """Two frames: one fish at 0.24 m and at 0.20 m, guessed once; one lost at first."""
    fit = ring.RingFit(centre_px=(100.0, 50.0), inner_m=0.2, outer_m=0.28, residual_m=0.0)
    east_px = np.array([[[0.24, 0.0], [np.nan, np.nan]], [[-0.20, 0.0], [0.0, 0.25]]]) * PX_PER_M
    guessed = np.array([[True, False], [False, False]])
    run = ring.RingRun(xy_px=np.add(east_px, (100.0, 50.0)), guessed=guessed, robot=None)

    np.testing.assert_allclose(run.guessed_share, [0.5, 0.0])
    np.testing.assert_allclose(run.middle_share(fit), [0.5, 1.0])


def test_the_ring_arena_is_the_shipped_one_but_for_the_speeds(ring):
    """Same walls, zones and bins of D and W, so that anybody can repeat it with --arena ring."""
    ours, shipped = arena_of(ring.ring_arena()), load_arena("ring", Path())

    assert ours.zone_names == shipped.zone_names
    assert ours.outline.equals_exact(shipped.outline, 1e-6)
    assert ours.bins.distance_m == shipped.bins.distance_m
    assert ours.bins.wall_distance_m == shipped.bins.wall_distance_m
    assert ours.bins.speed_m_s == (0.0, 0.4)


def test_two_rooms_are_joined_by_the_corridor_between_their_inner_corners(recordings):
    """Octagons of 0.3 m at (0, 0) and (0.5, 0.5): a point in each part is in its zone."""
    a = [(0, 0.1), (0.1, 0), (0.25, 0), (0.3, 0.05), (0.3, 0.25), (0.5, 0.45)]
    b = [(0.7, 0.45), (0.8, 0.55), (0.8, 0.7), (0.7, 0.8), (0.55, 0.8), (0.45, 0.7)]
    corners = np.array([*a, *b, (0.45, 0.5), (0.25, 0.3), (0.1, 0.3), (0, 0.25)], dtype=float)

    arena = arena_of(recordings.rooms_arena(corners))

    assert arena.zone_names == ("corridor", "walls", "centre")
    zones = arena.zone_of([(0.37, 0.37), (0.28, 0.2), (0.14, 0.14), (0.9, 0.1)])
    assert zones.tolist() == [1, 2, 3, 0]
    # Between (0.3, 0.25), (0.5, 0.45), (0.45, 0.5) and (0.25, 0.3): 0.2 sqrt(2) by 0.05 sqrt(2).
    assert arena.zones[0].polygon.area == pytest.approx(0.02)
    assert shapely.is_ccw(arena.outline.exterior)


def test_other_numbers_of_corners_are_no_two_rooms(recordings):
    """Four corners are one room."""
    with pytest.raises(InputError, match="need 16 corners"):
        recordings.rooms_arena(np.zeros((4, 2)))


def trial_of(root, recording):
    """Import a recording into a new trial and analyse it; return the warnings."""
    told = []
    options = dict(zip(recording.init[::2], recording.init[1::2], strict=False))
    arena = root.with_suffix(".geojson")
    arena.write_text(json.dumps(recording.arena), encoding="utf-8")
    robot = recording.has_robot
    fps = float(recording.init[-1])
    new = NewTrial(n_fish=int(options["--fish"]), n_robots=int(robot), fps=fps, arena=str(arena))
    create_trial(root, new, say_nothing)
    given = dict(zip(recording.import_[::2], recording.import_[1::2], strict=False))
    known = {"flip_y": "--flip-y" in recording.import_}
    if "--mm-per-px" in given:
        known["m_per_px"] = float(given["--mm-per-px"]) / 1000
        known["origin"] = tuple(float(part) for part in given["--origin"].split(","))
    source = Source(path=recording.source, format=given["--format"], options=known)
    import_tracks(root, source, told.append)
    analyse(root, AnalyseOptions(), told.append)
    assert not [event for event in told if isinstance(event, LeftOut)]
    return [event.text for event in told if isinstance(event, Note) and event.warning]


def frequencies_of(root, end_s, feature, case="control"):
    """Return the sums of a feature's frequencies by zone in a window."""
    rows = read_table(root / "stats" / f"{end_s:06d}.parquet", "zfcal.stats/1").to_pandas()
    rows = rows[(rows.feature == feature) & (rows.case == case)]
    return rows.groupby("zone").frequency.sum()


def test_fish_and_robot_in_the_ring_are_imported_and_analysed(
    ring, recordings, shared_data, tmp_path, monkeypatch
):
    """Three minutes: a robot and five fish inside the ring, guesses kept with low confidence."""
    read = ring.read_ring
    monkeypatch.setattr(recordings, "read_ring", lambda path: read(path).first(181.0))

    recording = recordings.ring_recording(shared_data, "Follower_model_1", tmp_path)
    assert not trial_of(tmp_path / "trial", recording)

    assert recording.has_robot
    tracks = read_tracks(segment_path(tmp_path / "trial", 60))
    assert len(np.unique(tracks.agent[tracks.kind == FISH])) == 5
    assert len(np.unique(tracks.agent[tracks.kind == ROBOT])) == 1
    radius_m = np.hypot(tracks.x_m, tracks.y_m)[tracks.confidence > 0.5]
    assert 0.185 < radius_m.min() < 0.215
    assert 0.27 < radius_m.max() < 0.295
    assert 0.02 < (tracks.confidence < 0.5).mean() < 0.4
    assert frequencies_of(tmp_path / "trial", 180, "W").round(9).eq(1).all()
    scores = read_table(tmp_path / "trial" / "scores" / "000180.parquet", "zfcal.scores/1")
    assert {"robot-vs-fish", "social-vs-control"} <= set(scores.column("compared").to_pylist())


def test_in_every_run_the_robot_is_the_column_that_was_hardly_ever_guessed(
    ring, recordings, shared_data, tmp_path, monkeypatch
):
    """In one run that is another column than the file names, and it is said."""
    monkeypatch.setattr(recordings, "write_csv", lambda *_: None)
    said = {}
    for name in (name for name in recordings.RINGS if not name.startswith("fish_only")):
        recording = recordings.ring_recording(shared_data, name, tmp_path)
        facts = recording.facts
        shares = np.array(facts["guessed_share"])
        assert facts["robot_column"] == shares.argmin()
        assert shares.min() < 0.4 * np.sort(shares)[1]
        if facts["robot_column"] != facts["robot_column_in_file"]:
            said[name] = recording.said

    assert list(said) == ["Follower_model_5"]
    assert "names column 4 as the robot's; column 0 is taken" in said["Follower_model_5"][-1]


def test_five_zebrafish_tracked_by_hand_are_imported_and_analysed(
    recordings, shared_data, tmp_path
):
    """All five in all 15 000 frames, in a tank of half a metre whose walls they touch."""
    recording = recordings.five_recording(shared_data, tmp_path)

    assert not trial_of(tmp_path / "trial", recording)

    arena = load_arena("arena.geojson", tmp_path / "trial")
    assert arena.extent_m == pytest.approx(0.506, abs=0.001)
    assert recording.halves_s == (0, 234, 468)
    tracks = read_tracks(segment_path(tmp_path / "trial", 120))
    assert len(tracks) == 5 * 60 * 32
    assert (arena.zone_of(np.column_stack([tracks.x_m, tracks.y_m])) > 0).all()
    assert frequencies_of(tmp_path / "trial", 420, "D").round(9).eq(1).all()


def test_one_fish_in_two_rooms_is_imported_and_analysed(recordings, shared_data, tmp_path):
    """Both rooms and the corridor are visited; a lone fish has no distances to others."""
    recording = recordings.rooms_recording(shared_data, tmp_path)

    warnings = trial_of(tmp_path / "trial", recording)

    # Where the tracker lost it, its path leads straight through a wall.
    assert warnings
    assert all("lie outside the arena and do not count" in warning for warning in warnings)
    rows = read_table(tmp_path / "trial" / "stats" / "000600.parquet", "zfcal.stats/1").to_pandas()
    occupation = rows[rows.feature == "O"].set_index("zone")["count"]
    assert (occupation[["corridor", "walls", "centre"]] > 0).all()
    assert rows[rows.feature == "D"]["count"].sum() == 0


@pytest.fixture
def results(repository):
    """Return the numbers that the documentation states."""
    path = repository / "benchmarks" / "results" / "real_recordings.json"
    return json.loads(path.read_text("utf-8"))


def test_the_documented_tables_are_those_of_the_numbers(repository, document, results):
    """Filling the document again changes nothing."""
    text = (repository / "docs" / "real-recordings.md").read_text("utf-8")

    assert document.filled(text, results) == text


def test_every_documented_score_stands_with_its_ceiling_and_its_picture(repository, results):
    """A score without a ceiling says nothing, and a picture is small."""
    for name, one in results["recordings"].items():
        for key in ("before", "after"):
            table = one["held_out"][key]
            assert 0 < table["S"] <= 1
            assert table["ceiling_low"] <= table["ceiling"] <= table["ceiling_high"]
        picture = repository / "docs" / "pictures" / f"real-{name}.png"
        assert 0 < picture.stat().st_size < 150_000


def test_a_text_without_the_place_of_a_table_is_refused(document, results):
    """Nothing is written past its place."""
    with pytest.raises(ValueError, match="<!-- recordings -->"):
        document.filled("no tables here", results)


def test_tables_show_a_dash_where_there_is_no_number(document):
    """None is a dash, never a zero."""
    assert document.score(None) == "–"
    assert document.share(None) == "–"
    assert document.score(0.12345) == "0.123"
    assert document.share(0.12345) == "12.3 %"


def test_the_results_file_holds_short_numbers_on_short_lines(document):
    """Four decimals, and a list of numbers on one line; it reads back as it was."""
    text = document.as_json({"a": [0.123456, None, 2], "b": {"c": [[1, 2], [3, 4]]}})

    assert json.loads(text) == {"a": [0.1235, None, 2], "b": {"c": [[1, 2], [3, 4]]}}
    assert '"a": [0.1235, null, 2]' in text
