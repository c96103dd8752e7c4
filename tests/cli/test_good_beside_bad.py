"""A file that is none ends no run: it is named, and the good ones beside it are worked on."""

import os
import signal

import pytest

from zfcal.report import page

QUICK = ("--generations", "1", "--population", "4", "--steps", "20", "--no-seed-likelihood")
IMPORT = ("import", "tracks.csv", "trial", "--format", "csv", "--force")
ANALYSE = ("analyse", "trial", "--force")
CALIBRATE = ("calibrate", "trial", "--force", *QUICK)


@pytest.fixture(autouse=True)
def in_time():
    """End a test that waits for a pipe."""
    signal.alarm(100)
    yield
    signal.alarm(0)


def _put(path, kind):
    path.unlink(missing_ok=True)
    makes = {
        "pipe": lambda: os.mkfifo(path),
        "loop": lambda: path.symlink_to(path.name),
        "folder": path.mkdir,
        "device": lambda: path.symlink_to("/dev/zero"),
        "huge": lambda: (path.touch(), os.truncate(path, 600 * 10**6)),
    }
    makes[kind]()


@pytest.mark.parametrize("kind", ["pipe", "loop", "folder", "device", "huge"])
def test_analyse_and_check_name_what_is_no_segment(zfcal, trial, kind):
    """The window before it is analysed all the same."""
    _put(trial / "tracks" / "000120.parquet", kind)
    done = zfcal("analyse", "trial")
    assert done.code == 3
    what = "is too large (600.0 MB" if kind == "huge" else "cannot be read"
    assert f"tracks/000120.parquet: {what}" in done.err
    assert done.lines == [f"trial/{name}" for name in ANALYSED]
    checked = zfcal("check", "trial")
    assert checked.code == 3
    # Its end is looked at first, and is none of a table's.
    what = "is not a Parquet file" if kind == "huge" else what
    assert f"tracks/000120.parquet: {what}" in checked.out


def test_statistics_are_not_written_through_a_link_that_leads_outside(zfcal, trial, tmp_path):
    """The link is named, and nothing comes into being behind it."""
    (tmp_path / "theirs").mkdir()
    (trial / "stats").symlink_to(tmp_path / "theirs")
    done = zfcal("analyse", "trial")
    assert done.code == 1
    assert "stats" in done.err
    assert "leads outside the trial" in done.err
    assert list((tmp_path / "theirs").iterdir()) == []
    assert "leads outside the trial" in zfcal("check", "trial").out


def _analysed(end):
    return [f"stats/{end}.parquet", f"stats/{end}-following.parquet", f"scores/{end}.parquet"]


ANALYSED = _analysed("000120")


def _round(end):
    scores = {f"scores/{end}-model.parquet", f"scores/{end}-rules.parquet"}
    return {f"models/{end}.parquet", f"models/{end}.toml"} | scores


TAKEN = {
    "tracks/000060.parquet": (IMPORT, {f"tracks/{k:06d}.parquet" for k in (0, 120, 180)}),
    **{name: (ANALYSE, {*ANALYSED, *_analysed("000180")} - {name}) for name in ANALYSED},
    "models/000120.toml": (CALIBRATE, _round("000180")),
    "models/000120.parquet": (CALIBRATE, _round("000180")),
    "scores/000120-model.parquet": (CALIBRATE, _round("000180")),
    "scores/000120-rules.parquet": (CALIBRATE, _round("000180")),
    "models/.000120.checkpoint": (CALIBRATE, _round("000120") | _round("000180")),
}


@pytest.mark.parametrize("name", TAKEN)
def test_an_output_whose_place_a_folder_takes_is_left_out_alone(zfcal, trial, name):
    """It is named, the folder stays, the others are made; once it is gone, this one as well."""
    words, made = TAKEN[name]
    if words == CALIBRATE:
        assert zfcal("analyse", "trial").code == 0
    place = trial / name
    place.unlink(missing_ok=True)
    place.mkdir(parents=True)
    (place / "notes.txt").write_text("mine")
    done = zfcal(*words)
    assert done.code == 3, done.err
    assert done.err.count(f"left out: trial/{name}: cannot be written (Is a directory)") == 1
    assert "A folder stands where the file is to go: move it away." in done.err
    assert set(done.lines) == {f"trial/{each}" for each in made}
    assert (place / "notes.txt").read_text() == "mine"
    place.rename(trial.parent / "away")
    again = zfcal(*words)
    assert again.code == 0, again.err
    assert place.is_file() or name.endswith(".checkpoint")


def test_a_folder_in_the_place_of_a_segment_of_old_stays(zfcal, trial):
    """The recording does not reach there: it is named, and the others are written."""
    (trial / "tracks" / "000240.parquet").mkdir()
    done = zfcal(*IMPORT)
    assert done.code == 3
    assert "tracks/000240.parquet: cannot be removed (Is a directory)" in done.err
    assert len(done.lines) == 4


def test_a_folder_named_like_a_round_that_was_passed_over_passes_none_over(zfcal, trial):
    """Only a file says that a window was passed over."""
    assert zfcal("analyse", "trial").code == 0
    (trial / "models" / "000120.skipped.json").mkdir()
    done = zfcal("calibrate", "trial", *QUICK)
    assert done.code == 0, done.err
    assert "trial/models/000120.toml" in done.lines


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("diagnosis/findings.json", ("diagnose", "trial", "--quick")),
        pytest.param("report/index.html", ("report", "trial"), marks=pytest.mark.slow),
    ],
)
def test_a_command_with_one_output_says_that_a_folder_takes_its_place(zfcal, trial, name, words):
    """Nothing else is to be made: it ends with exit code 1, a diagnosis before it has begun."""
    (trial / name).mkdir(parents=True)
    done = zfcal(*words)
    assert done.code == 1
    assert f"trial/{name}: cannot be written (Is a directory)" in done.err
    assert "A folder stands where the file is to go" in done.err


def test_folders_and_files_may_be_linked_within_a_trial(zfcal, trial):
    """Tracks are kept elsewhere in it, and statistics are written through such a link."""
    kept = trial / "kept"
    kept.mkdir()
    (trial / "tracks").rename(kept / "tracks")
    (trial / "tracks").symlink_to("kept/tracks")
    (kept / "tracks" / "000060.parquet").rename(kept / "minute.parquet")
    (kept / "tracks" / "000060.parquet").symlink_to("../minute.parquet")
    (kept / "stats").mkdir()
    (trial / "stats").symlink_to(kept / "stats")
    for words in (("analyse", "trial"), ("calibrate", "trial", *QUICK)):
        done = zfcal(*words)
        assert done.code == 0, done.err
    assert (kept / "stats" / "000120.parquet").is_file()
    assert (trial / "models" / "000180.toml").is_file()
    assert "error" not in zfcal("check", "trial").out


LINKED = {
    "analyse": "tracks/000120.parquet",
    "calibrate": "stats/000180.parquet",
    "diagnose": "tracks/000120.parquet",
    "report": "tracks/000120.parquet",
    "check": "tracks/000120.parquet",
    "inspect": "tracks/000120.parquet",
    "track": "frames/overhead/000000.mcap",
    "import": "foreign.csv",
}
WORDS = {
    "calibrate": QUICK,
    "diagnose": ("--quick", "--dry-run"),
    "track": (
        *("--overhead", "trial/frames/overhead", "--corners", "0,9 9,9 9,0 0,0"),
        *("--robot-as-fish", "--force"),
    ),
    "import": ("--format", "csv", "--force"),
}


@pytest.mark.parametrize("command", LINKED)
def test_every_command_that_refuses_a_link_says_what_to_do(
    zfcal, trial, tmp_path, monkeypatch, command
):
    """With where the file lies, for what may be named there, or how to put it into the trial."""
    monkeypatch.setattr(page, "write_printed", lambda _p, _k, part, _: part.write_bytes(b"drawn"))
    monkeypatch.setattr(page, "render_page", lambda *_: "drawn")
    assert zfcal("analyse", "trial").code == 0
    place, theirs = trial / LINKED[command], tmp_path / "theirs"
    place.parent.mkdir(parents=True, exist_ok=True)
    if place.exists():
        place.rename(theirs)
    else:
        theirs.write_bytes(b"x")
    place.symlink_to(theirs)
    given = {"inspect": [place], "import": [place, "trial"]}.get(command, ["trial"])
    done = zfcal(command, *given, *WORDS.get(command, ()))
    assert done.code == (1 if command in {"inspect", "track", "import"} else 3)
    said = done.err + done.out
    assert "leads outside the trial" in said
    assert f"cp --remove-destination {theirs} {place}" in said
    if command in {"track", "import"}:
        assert "where " in said
        assert f"{theirs if command == 'import' else tmp_path}" in said
