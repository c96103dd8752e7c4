"""`zfcal reproduce`: archives in, a verdict out."""

import json

import pytest

from zfcal.artifacts.validation import check
from zfcal.reproduction.courses import driving_courses, models_of
from zfcal.reproduction.twin import random_start
from zfcal.stages.trial_context import open_trial

QUICK = ("--generations", "0")
TANK = ("--arena", "open-square", "--fish", "3", "--robot", "--fps", "5")


@pytest.fixture
def archive(trial):
    """Return a trial of two windows as an archive: what was made of its tracks is not there."""
    return trial


def said(folder):
    """Return the document, which fits its schema."""
    place = folder / "reproduction.json"
    document = json.loads(place.read_text())
    check(document, "reproduction", place)
    return document


@pytest.mark.slow
def test_an_archive_is_calibrated_and_judged(zfcal, archive, tmp_path):
    """One trial decides nothing: exit code 4, and the reason is said."""
    before = sorted(path.relative_to(archive) for path in archive.rglob("*"))
    done = zfcal("reproduce", "trial", "-o", "again", *QUICK)
    assert done.code == 4, done.err
    document = said(tmp_path / "again")
    assert document["verdict"] == "undecided"
    assert document["ways"][0]["trials"] == ["trial"]
    assert "there is no standard error" in done.err
    assert (tmp_path / "again" / "trial" / "models" / "000120.toml").exists()
    assert sorted(path.relative_to(archive) for path in archive.rglob("*")) == before


@pytest.mark.slow
def test_twice_gives_the_same_bytes(zfcal, archive, tmp_path):
    """The second run has nothing to do."""
    zfcal("reproduce", "trial", "-o", "again", *QUICK)
    names = ["reproduction.json", "reproduction.csv", "reproduction.png"]
    first = [(tmp_path / "again" / name).read_bytes() for name in names]
    done = zfcal("reproduce", "trial", "-o", "again", *QUICK)
    assert "nothing to do" in done.err
    assert [(tmp_path / "again" / name).read_bytes() for name in names] == first


@pytest.mark.slow
def test_a_reference_of_ones_own_decides(zfcal, archive, tmp_path):
    """Its contrasts and no others; the window to 120 s is one of them."""
    text = """schema = "zfcal.reference/1"
source = "ours"
n_trials = 5
intervals = []
[[contrasts]]
name = "first"
feature = "O"
from_s = 120
to_s = 120
value = 0.9
"""
    (tmp_path / "ours.toml").write_text(text)
    zfcal("reproduce", "trial", "-o", "again", "--reference", "ours.toml", *QUICK)
    (contrast,) = said(tmp_path / "again")["ways"][0]["contrasts"]
    assert (contrast["name"], contrast["published"], contrast["n"]) == ("first", 0.9, 1)


@pytest.mark.slow
def test_the_authors_scoring_is_another_number(zfcal, archive, tmp_path):
    """Of the same models; W is not scored by it."""
    values = {}
    for scoring in ("paper", "legacy"):
        zfcal("reproduce", "trial", "-o", scoring, "--scoring", scoring, *QUICK)
        rows = said(tmp_path / scoring)["ways"][0]["intervals"]
        values[scoring] = {(row["feature"], row["end_s"]): row["mean"] for row in rows}
    assert ("W", 120) in values["paper"]
    assert ("W", 120) not in values["legacy"]
    assert values["paper"]["S", 120] != values["legacy"]["S", 120]


@pytest.mark.slow
def test_tracks_of_another_program_become_a_trial(zfcal, tracks_csv, tmp_path, monkeypatch):
    """With the tank that is said."""
    monkeypatch.chdir(tmp_path)
    tracks_csv("old.csv")
    done = zfcal("reproduce", "old.csv", "-o", "again", *TANK, *QUICK)
    assert done.code == 4, done.err
    assert said(tmp_path / "again")["ways"][0]["trials"] == ["old"]


@pytest.mark.slow
def test_a_table_that_was_changed_is_made_again(zfcal, archive, tmp_path):
    """And said; the numbers are those that they were."""
    zfcal("reproduce", "trial", "-o", "again", *QUICK)
    place = tmp_path / "again" / "reproduction.csv"
    whole = place.read_bytes()
    place.write_bytes(whole[:100])
    done = zfcal("reproduce", "trial", "-o", "again", *QUICK, "-v")
    assert "reproduction.csv is missing or was changed" in done.err
    assert place.read_bytes() == whole


@pytest.mark.slow
def test_until_180_s_a_robot_has_what_it_began_with(zfcal, tracks_csv, tmp_path, monkeypatch):
    """Then the model of the window that ended two minutes before, whatever it began with."""
    monkeypatch.chdir(tmp_path)
    tracks_csv("old.csv", seconds=250)
    zfcal("reproduce", "old.csv", "-o", "again", *TANK, *QUICK)
    root = tmp_path / "again" / "old"
    given = models_of(open_trial(root))[0]
    one, other = driving_courses(root, [given, random_start(root)])
    assert {end_s for _, end_s in one} == {120, 180, 240}
    assert one["S", 120] != other["S", 120]
    assert one["S", 180] != other["S", 180]
    assert one["S", 240] == other["S", 240]
    (root / "models" / "000120.toml").write_bytes((root / "models" / "000180.toml").read_bytes())
    assert driving_courses(root, [given])[0]["S", 240] != one["S", 240]


RESULTS = ["reproduction.json", "reproduction.csv", "reproduction.png"]


def planned(done, folder):
    """Return the files that a dry run would make, by their path in the folder."""
    document = json.loads(done.out)
    assert done.code == document["exit_code"] == 0, done.err
    assert {each["state"] for each in document["artifacts"]} <= {"planned", "up to date"}
    names = [each["path"] for each in document["artifacts"] if each["state"] == "planned"]
    return [name.removeprefix(f"{folder}/") for name in names]


def test_a_dry_run_says_what_an_archive_becomes(zfcal, archive, tmp_path):
    """And what follows of that; nothing is written."""
    done = zfcal("reproduce", "trial", "-o", "again", *QUICK, "--dry-run", "--json")
    tracks = sorted(f"trial/tracks/{path.name}" for path in (archive / "tracks").iterdir())
    settings = ["arena.geojson", "models/000000.toml", "trial.toml"]
    files = [*(f"trial/{name}" for name in settings), *tracks]
    assert sorted(planned(done, "again")) == sorted([*files, *RESULTS])
    assert "again/trial: is analysed and calibrated after that." in done.err
    assert not (tmp_path / "again").exists()


def test_a_dry_run_says_that_foreign_tracks_are_imported(zfcal, tracks_csv, tmp_path, monkeypatch):
    """How many segments they have only their import knows."""
    monkeypatch.chdir(tmp_path)
    tracks_csv("old.csv")
    done = zfcal("reproduce", "old.csv", "-o", "again", *TANK, *QUICK, "--dry-run", "--json")
    settings = ["old/trial.toml", "old/models/000000.toml"]
    assert planned(done, "again") == [*settings, *RESULTS]
    assert "old.csv: is imported into again/old/tracks after that." in done.err
    assert not (tmp_path / "again").exists()


def test_a_dry_run_says_what_a_twin_records(zfcal, tmp_path):
    """The tracks of each virtual trial, and what is made of it."""
    words = ("--twin", "--trials", "2", "--duration", "3min", "-o", "twin")
    done = zfcal("reproduce", *words, "--dry-run", "--json")
    tracks = [
        f"tanks/twin-0{k}/trial/tracks/{start:06d}.parquet"
        for k in (1, 2)
        for start in (0, 60, 120)
    ]
    assert planned(done, "twin") == [*tracks, *RESULTS]
    assert "twin/default/twin-02: is made of twin/tanks/twin-02/trial and calib" in done.err
    assert not (tmp_path / "twin").exists()


@pytest.mark.slow
def test_a_dry_run_goes_as_far_as_there_is_something(zfcal, archive, tmp_path):
    """Nothing where all is there; then what one missing file leads to."""
    dry = ("reproduce", "trial", "-o", "again", *QUICK, "--dry-run", "--json")
    zfcal("reproduce", "trial", "-o", "again", *QUICK)
    before = {path: path.stat().st_mtime_ns for path in (tmp_path / "again").rglob("*")}
    done = zfcal(*dry)
    assert planned(done, "again") == []
    assert planned(zfcal(*dry[:-1], "--force", "--json"), "again")[-3:] == RESULTS
    assert {path: path.stat().st_mtime_ns for path in (tmp_path / "again").rglob("*")} == before

    (tmp_path / "again" / "trial" / "models" / "000120.toml").unlink()
    assert {"trial/models/000120.toml", *RESULTS} <= {*planned(zfcal(*dry), "again")}
    (tmp_path / "again" / "trial" / "stats" / "000120.parquet").unlink()
    done = zfcal(*dry)
    assert "trial/stats/000120.parquet" in planned(done, "again")
    assert "again/trial: is calibrated after that." in done.err


@pytest.mark.parametrize(("words", "says"), [
    ((), "Missing argument 'ARCHIVE...'; or --twin."),
    (("trial", "--twin"), "--twin makes its own trials"),
    (("trial", "--trials", "3"), "--trials belongs to --twin."),
    (("--twin", "--scoring", "legacy"), "--scoring belongs to archives."),
    (("--twin", "--flip-y"), "--flip-y belongs to archives."),
])  # fmt: skip
def test_what_cannot_take_effect_is_wrong_usage(zfcal, archive, words, says):
    """Exit code 2."""
    done = zfcal("reproduce", *words)
    assert done.code == 2
    assert says in done.err


@pytest.mark.parametrize(("words", "says"), [
    (("nowhere",), "nowhere: no such archive."),
    (("old.csv",), "old.csv: is not a trial, and its tank is not known."),
    (("trial", "-o", "trial/again"), "lies in the archive trial"),
])  # fmt: skip
def test_a_wrong_archive_is_named(zfcal, archive, tracks_csv, words, says):
    """One line, exit code 1."""
    tracks_csv("old.csv")
    done = zfcal("reproduce", *words)
    assert done.code == 1
    assert says in done.err


def test_a_reference_that_is_no_toml_is_an_error(zfcal, archive, tracks_csv, tmp_path):
    """Exit code 1, not that of work that was done without a damaged file."""
    tracks_csv("old.csv")
    done = zfcal("reproduce", "trial", "--reference", "old.csv", "-o", "again")
    assert done.code == 1
    assert "old.csv: is not valid TOML" in done.err
    assert not (tmp_path / "again").exists()


@pytest.mark.slow
def test_a_small_twin_says_what_holds(zfcal, tmp_path, monkeypatch):
    """One trial of three minutes: four ways, all statements, none of them decided."""
    monkeypatch.chdir(tmp_path)
    done = zfcal("reproduce", "--twin", "--trials", "1", "--duration", "3min", "-o", "twin")
    assert done.code == 4, done.err
    document = said(tmp_path / "twin")
    assert [way["name"] for way in document["ways"]] == [
        "as published", "driving, random start", "driving, given start", "our default",
    ]  # fmt: skip
    assert {each["holds"] for each in document["statements"]} == {"open"}
    given, random = (
        {(row["feature"], row["end_s"]): row["mean"] for row in way["intervals"]}
        for way in (document["ways"][2], document["ways"][1])
    )
    assert given["S", 180] != random["S", 180]
