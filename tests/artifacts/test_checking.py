"""zfcal check: every artifact whole and valid, and a computer fit to run a trial."""

import os
import subprocess
import sys
import time

import pytest

from zfcal.artifacts import checking, machine
from zfcal.artifacts.checking import check_trial
from zfcal.artifacts.findings import ERROR, NOTE, OK, WARNING
from zfcal.artifacts.freshness import hash_inputs
from zfcal.artifacts.lineage import Lineage
from zfcal.artifacts.tables import SCORES, TRACKS, write_table, write_tracks
from zfcal.errors import InputError
from zfcal.tracks import Tracks

COMPUTER = {"versions", "cores", "disk", "file system", "clock"}


@pytest.fixture(autouse=True)
def _calm_computer(monkeypatch):
    """Let the computer that runs the tests have a local disk with room."""
    monkeypatch.setattr(machine, "free_bytes", lambda _: 2**40)
    monkeypatch.setattr(machine, "file_system", lambda _: "ext4")


def found_in(trial, where, **options):
    """Return what a check says of one file, as (level, text)."""
    return [(f.level, f.says) for f in check_trial(trial.root, **options) if f.where == where]


def troubles(trial, **options):
    """Return everything that is not in order, as (level, where)."""
    found = check_trial(trial.root, **options)
    return [(f.level, f.where) for f in found if f.level != OK]


def test_a_sound_trial_has_nothing_to_mend(trial):
    """Each folder is counted, the computer is described."""
    found = check_trial(trial.root)

    assert [f for f in found if f.level != OK] == []
    assert {f.where: f.says for f in found if f.where in {"tracks", "scores", "models"}} == {
        "tracks": "1 whole and valid",
        "scores": "1 whole and valid",
        "models": "1 whole and valid",
    }
    assert {f.where for f in found} >= COMPUTER
    assert next(f.says for f in found if f.where == "trial.toml") == "arena two-rooms"


@pytest.mark.parametrize(
    "name", ["tracks/000000.parquet", "scores/000120.parquet", "models/000000.toml"]
)
def test_a_damaged_artifact_is_an_error_and_the_rest_is_checked(trial, name):
    """It is named, without its path twice, with what to do."""
    path = trial.root / name
    path.write_bytes(path.read_bytes()[:40])

    found = [f for f in check_trial(trial.root) if f.level == ERROR]

    assert [f.where for f in found] == [name]
    assert str(trial.root) not in found[0].says
    assert not found[0].says.endswith(".")
    assert found[0].hint
    assert (OK, "disk") in [(f.level, f.where) for f in check_trial(trial.root)]


def test_wrong_settings_do_not_stop_the_check(trial):
    """The artifacts are checked all the same."""
    trial.config.write_text(trial.config.read_text().replace("n_fish", "n_fihs"))
    trial.path("tracks", 0, ".parquet").write_bytes(b"")

    assert troubles(trial) == [
        (ERROR, "trial.toml"),
        (ERROR, "tracks/000000.parquet"),
    ]


def test_a_missing_arena_or_model_is_an_error(trial):
    """trial.toml names them."""
    text = trial.config.read_text()
    trial.config.write_text(text.replace('"two-rooms"', '"two-room"'))
    assert (ERROR, "two-room") in troubles(trial)

    trial.config.write_text(text.replace("models/000000.toml", "models/mine.toml"))
    assert (ERROR, "models/mine.toml") in troubles(trial)


def test_a_model_of_another_arena_is_an_error(trial):
    """Its zones are not those of the trial."""
    trial.config.write_text(trial.config.read_text().replace('"two-rooms"', '"ring"'))

    assert "zone 'inner' of arena 'ring' is missing" in found_in(trial, "models/000000.toml")[0][1]


def test_an_input_that_changed_makes_an_artifact_out_of_date(trial, scores):
    """A warning that says which, and how to make it again."""
    tracks = trial.path("tracks", 0, ".parquet")
    lineage = Lineage(
        schema=SCORES, command="analyse", inputs=hash_inputs(trial.root, [tracks, trial.config])
    )
    write_table(trial.path("scores", 120, ".parquet"), scores, lineage)
    assert troubles(trial) == []

    trial.config.write_text(trial.config.read_text() + "# a remark\n")
    [finding] = [f for f in check_trial(trial.root) if f.level != OK]

    assert (finding.level, finding.where) == (WARNING, "scores/000120.parquet")
    assert finding.says == "is out of date: its input trial.toml has changed"
    assert finding.hint == f"Make it again with: zfcal analyse {trial.root}"


def test_an_input_that_is_gone_is_noted(trial, tracks):
    """The raw files may lie elsewhere by now."""
    lineage = Lineage(schema=TRACKS, command="import", inputs={"../raw.csv": "0" * 64})
    write_tracks(trial.path("tracks", 0, ".parquet"), tracks, lineage)

    assert found_in(trial, "tracks/000000.parquet") == [(NOTE, "its input ../raw.csv is gone")]


def test_a_source_outside_the_trial_is_not_looked_for(trial, tracks):
    """It is known by its bare name: that it does not lie in the trial says nothing."""
    lineage = Lineage(schema=TRACKS, command="import", inputs={"raw.csv": "0" * 64})
    write_tracks(trial.path("tracks", 0, ".parquet"), tracks, lineage)

    assert troubles(trial) == []


def test_artifacts_of_another_version_are_noted(trial, tracks):
    """No reason to worry, and none to recompute."""
    lineage = Lineage(schema=TRACKS, command="import", version="0.0.1")
    write_tracks(trial.path("tracks", 0, ".parquet"), tracks, lineage)

    assert found_in(trial, "tracks/000000.parquet")[0][0] == NOTE
    assert "was made by zfcal 0.0.1" in found_in(trial, "tracks/000000.parquet")[0][1]


def test_times_outside_the_segment_are_a_warning(trial, make_tracks):
    """A segment of the second minute under the name of the first."""
    lineage = Lineage(schema=TRACKS, command="import")
    write_tracks(trial.path("tracks", 0, ".parquet"), make_tracks(start_s=58.0), lineage)

    [(level, says)] = found_in(trial, "tracks/000000.parquet")
    assert level == WARNING
    assert says.startswith("holds 45 rows outside 0 s to 60 s, such as 60.000 s")


def test_positions_outside_the_arena_are_a_warning(trial, tracks):
    """Such as tracks in another unit, or with y down."""
    columns = {name: getattr(tracks, name) for name in Tracks.__slots__}
    columns["y_m"] = columns["y_m"] - 0.6
    lineage = Lineage(schema=TRACKS, command="import")
    write_tracks(trial.path("tracks", 0, ".parquet"), Tracks(**columns), lineage)

    assert found_in(trial, "tracks/000000.parquet") == [
        (WARNING, "100% of the positions lie outside arena two-rooms")
    ]


def test_a_segment_of_nobody_is_noted(trial, tracks):
    """It is whole, and there is nothing in it."""
    lineage = Lineage(schema=TRACKS, command="import")
    write_tracks(trial.path("tracks", 0, ".parquet"), tracks.take(slice(0, 0)), lineage)

    assert found_in(trial, "tracks/000000.parquet") == [
        (NOTE, "no animal was seen in this segment")
    ]


def test_a_file_of_the_future_is_a_warning(trial):
    """The clocks of the computers that share the trial differ; two seconds are forgiven."""
    path = trial.path("tracks", 0, ".parquet")
    now_s = time.time()
    os.utime(path, (now_s + 100, now_s + 100))
    os.utime(trial.path("scores", 120, ".parquet"), (now_s + 1, now_s + 1))

    assert troubles(trial, now_s=now_s) == [(WARNING, "tracks/000000.parquet")]
    assert found_in(trial, "tracks/000000.parquet", now_s=now_s)[0][1] == (
        "was changed 100 s in the future"
    )


def test_a_growing_mcap_is_noted_and_a_cut_one_is_a_warning(trial, write_mcap):
    """A file that changed just now may be growing; later it was cut short."""
    path = trial.root / "poses" / "000000.mcap"
    write_mcap(path, finish=False)

    assert found_in(trial, "poses/000000.mcap") == [
        (NOTE, "not closed: still grows, or its writer was stopped")
    ]
    assert "poses" not in {f.where for f in check_trial(trial.root)}
    [(level, says)] = found_in(trial, "poses/000000.mcap", now_s=time.time() + 60)
    assert level == WARNING
    assert "20 messages can be read" in says


def zeroed(path, place):
    """Overwrite 20 bytes of a file with zeros."""
    data = bytearray(path.read_bytes())
    data[place : place + 20] = bytes(20)
    path.write_bytes(data)


@pytest.fixture
def at_once(monkeypatch):
    """Let nobody wait for a tracker to close a minute."""
    monkeypatch.setattr(checking, "_CLOSING_S", 0.0)


@pytest.mark.usefixtures("at_once")
@pytest.mark.parametrize("folder", ["poses", "drive", "frames/overhead"])
def test_a_cut_mcap_that_another_follows_is_damaged(trial, write_mcap, folder):
    """However lately it was changed: it cannot grow any more. What is lost is said."""
    path = trial.root / folder / "000000.mcap"
    size = write_mcap(path) // 2
    write_mcap(trial.root / folder / "000060.mcap")
    path.write_bytes(path.read_bytes()[:size])

    [finding] = [f for f in check_trial(trial.root) if f.level != OK]

    assert (finding.level, finding.where) == (ERROR, f"{folder}/000000.mcap")
    assert finding.says.startswith("was cut short; ")
    assert f"of {size} bytes are lost" in finding.says
    assert "messages can be read" in finding.says
    assert finding.hint
    assert (OK, "1 whole and valid") in found_in(trial, folder.partition("/")[0])


def test_a_closed_mcap_that_is_damaged_within_is_an_error(trial, write_mcap):
    """Though it was changed just now: with its footer it cannot grow."""
    path = trial.root / "frames" / "overhead" / "000060.mcap"
    size = write_mcap(path)
    zeroed(path, size // 3)

    [(level, says)] = found_in(trial, "frames/overhead/000060.mcap")
    assert level == ERROR
    assert says.startswith("is damaged: a damaged record (")
    assert f"of {size} bytes are lost" in says
    assert "frames" not in {f.where for f in check_trial(trial.root)}


def test_a_growing_mcap_that_is_damaged_within_is_an_error(trial, write_mcap):
    """It may go on, but what lies behind the damage is lost."""
    path = trial.root / "poses" / "000000.mcap"
    zeroed(path, write_mcap(path, finish=False) - 300)

    assert found_in(trial, "poses/000000.mcap")[0][0] == ERROR


def test_a_minute_that_is_closed_just_after_the_next_began_is_whole(trial, write_mcap, monkeypatch):
    """A tracker writes the first frame of a minute before it closes the last one."""
    path = trial.root / "poses" / "000000.mcap"
    write_mcap(path, finish=False)
    write_mcap(trial.root / "poses" / "000060.mcap")
    monkeypatch.setattr(checking.time, "sleep", lambda _: write_mcap(path))

    assert troubles(trial) == []


def test_whole_mcap_files_are_counted(trial, write_mcap):
    """Of poses, of the robot and of both cameras."""
    for folder in ("poses", "drive", "frames/overhead", "frames/below"):
        write_mcap(trial.root / folder / "000000.mcap")

    counted = {f.where: f.says for f in check_trial(trial.root)}
    assert troubles(trial) == []
    assert counted["poses"] == "1 whole and valid"
    assert counted["frames"] == "2 whole and valid"


def test_what_a_killed_command_left_is_noted(trial):
    """With the command that removes it; what is being written now is left out."""
    killed = (
        "import os, signal, sys; from pathlib import Path;"
        "from zfcal.artifacts.atomic import write_whole;"
        "write_whole(Path(sys.argv[1]), lambda part: (part.write_text('half'),"
        "os.kill(os.getpid(), signal.SIGKILL)))"
    )
    path = trial.path("stats", 120, ".parquet")
    subprocess.run([sys.executable, "-c", killed, str(path)], check=False)
    (trial.root / "tracks" / ".000060.parquet.Xq81sb").write_text("rsync is at work")
    (trial.root / ".lock-analyse").touch()

    [finding] = [f for f in check_trial(trial.root) if f.level != OK]

    assert finding.where.startswith("stats/.000120.parquet.part-")
    assert finding.says.startswith("was left by a command that was killed")
    assert finding.hint.startswith("Remove it: rm ")
    (trial.root / "models" / ".000120.checkpoint").touch()
    later_s = time.time() + 2 * 3600
    assert len(troubles(trial, now_s=later_s)) == 3
    assert "calibrate goes on" in found_in(trial, "models/.000120.checkpoint", now_s=later_s)[0][1]


def test_files_that_no_command_reads_are_noted(trial):
    """Names with too few digits first of all; reports are free to hold anything."""
    for name in ("tracks/60.parquet", "notes.txt", "report/x.html", "diagnosis/figure.png"):
        path = trial.root / name
        path.parent.mkdir(exist_ok=True)
        path.write_text("x")

    assert found_in(trial, "tracks/60.parquet") == [
        (NOTE, "is not read: names have at least six digits")
    ]
    assert troubles(trial) == [(NOTE, "notes.txt"), (NOTE, "tracks/60.parquet")]


def test_the_record_of_a_closed_loop_is_read(trial):
    """Who removes it, as a file that nobody reads, has the whole loop made anew."""
    (trial.root / "closed-loop.json").write_text("{}")
    assert found_in(trial, "closed-loop.json") == []
    assert troubles(trial) == []


def test_a_wrong_diagnosis_is_an_error(trial):
    """Other programs read it."""
    path = trial.root / "diagnosis" / "findings.json"
    path.parent.mkdir()
    path.write_text('{"schema": "zfcal.findings/1", "verdict": "maybe"}')

    assert (ERROR, "diagnosis/findings.json") in troubles(trial)


@pytest.mark.parametrize(
    ("free", "level"), [(2**40, OK), (5 * 2**28, OK), (2**29, WARNING), (2**20, ERROR)]
)
def test_a_disk_that_fills_up_is_told(trial, monkeypatch, free, level):
    """Before it is full."""
    monkeypatch.setattr(machine, "free_bytes", lambda _: free)

    [(found, says)] = found_in(trial, "disk")
    assert found == level
    assert says == f"{free / 2**30:.1f} GiB free"


@pytest.mark.parametrize(("kind", "level"), [("nfs4", WARNING), ("fuse.sshfs", WARNING), ("", OK)])
def test_a_network_file_system_is_told(trial, monkeypatch, kind, level):
    """Watching needs --poll there."""
    monkeypatch.setattr(machine, "file_system", lambda _: kind)

    assert found_in(trial, "file system")[0][0] == level


def test_a_clock_that_was_never_set_is_a_warning(trial):
    """A computer whose battery is empty starts in 1970; then all files are of the future too."""
    found = check_trial(trial.root, now_s=1000.0)

    assert next(f.level for f in found if f.where == "clock") == WARNING


def test_what_is_no_folder_is_an_error(tmp_path):
    """A trial is one."""
    with pytest.raises(InputError, match="is no folder"):
        check_trial(tmp_path / "missing")


def test_an_empty_folder_is_no_trial_and_says_so(tmp_path):
    """The computer is described all the same."""
    found = check_trial(tmp_path)

    assert [f.where for f in found if f.level == ERROR] == ["trial.toml"]
    assert {f.where for f in found} >= COMPUTER
