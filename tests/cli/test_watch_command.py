"""zfcal watch, as people and scripts run it."""

import json
import shutil
import signal
from pathlib import Path

import pytest

from zfcal.artifacts.validation import check


@pytest.fixture
def live(trial, tmp_path):
    """Return an empty trial, and what brings the next segments of a recording of 200 s to it."""
    waiting = tmp_path / "waiting"
    shutil.move(trial / "tracks", waiting)
    (trial / "tracks").mkdir()

    def bring(*starts):
        for start in starts:
            name = f"{start:06d}.parquet"
            part = trial / "tracks" / f".{name}.part"
            shutil.copy(waiting / name, part)
            part.rename(trial / "tracks" / name)

    return trial, bring


def kinds(events, stage=None):
    """Return what happened, in order."""
    return [each["event"] for each in events if stage in (None, each.get("stage"))]


@pytest.mark.slow
def test_new_segments_are_analysed_and_calibrated_until_the_recording_ends(watching, live):
    """Each window as its second minute comes; the last part segment says that it is the end."""
    root, bring = live
    with watching.start(root, *watching.quick) as watch:
        watch.until("began")
        bring(0, 60)
        done = watch.until("finished", window_end_s=120)
        assert done["lag_s"] < 60
        assert (root / "models" / "000120.toml").exists()
        bring(120, 180)
        watch.until("finished", window_end_s=180)
        assert watch.wait() == 0
    assert watch.events[-1]["because"] == "the recording has ended"
    assert not (root / "models" / "000240.toml").exists()
    for event in watch.events:
        check(event, "watch-event", "a line")
    made = [each["path"].rpartition("/")[2] for each in watch.events if each["event"] == "made"]
    assert made.count("000180.toml") == 1
    assert "skipped" not in kinds(watch.events)


@pytest.mark.slow
def test_once_makes_what_offline_commands_make_and_leaves(process, zfcal, trial, watching):
    """The same bytes; run again, it does nothing and lists the same paths.

    Paths go to standard output, talk to standard error.
    """
    other = shutil.copytree(trial, trial.parent / "other")
    first = process("watch", "trial", "--once", *watching.quick)
    assert first.code == 0, first.err
    again = process("watch", "trial", "--once", *watching.quick, "-v")
    zfcal("analyse", "other")
    zfcal("calibrate", "other", *watching.quick)
    assert watching.contents(trial) == watching.contents(other)
    assert len(first.lines) == 14
    assert first.lines[0] == "trial/stats/000120.parquet"
    assert "watch: analyse, calibrate of trial." in first.err
    assert "calibrate: window to 120 s in" in first.err
    assert "\x1b" not in first.err
    assert sorted(again.lines) == sorted(first.lines)
    assert "nothing to do, 14 up to date" in again.err
    assert "arrived" in again.err


@pytest.mark.slow
def test_a_second_watch_ends_with_75(process, watching, live):
    """But one that runs another stage of the same trial may work beside it."""
    root, _ = live
    with watching.start(root, "--stages", "analyse") as watch:
        watch.until("began")
        second = process("watch", root, "--stages", "analyse,calibrate")
        assert second.code == 75
        assert "another zfcal watch-analyse is at work on this trial" in second.err
        beside = process("watch", root, "--stages", "calibrate", "--until-idle", "1s")
        assert beside.code == 0, beside.err
        assert watch.end() == 143


@pytest.mark.slow
def test_signals_end_it_with_nothing_half_done(process, zfcal, trial, watching):
    """In the middle of a round; run again, it goes on and ends in the bytes of offline commands."""
    slow = ["--generations", "30", *watching.quick[2:]]
    other = shutil.copytree(trial, trial.parent / "other")
    # The second signal comes in the next round, whether or not the first one was over by then.
    for number, code, end_s in ((signal.SIGINT, 130, 120), (signal.SIGTERM, 143, 180)):
        with watching.start(trial, "--once", *slow) as watch:
            watch.until("takes", window_end_s=end_s)
            assert watch.end(number) == code
        assert not list(trial.rglob(".*part-*"))
    assert process("watch", trial, "--once", *slow).code == 0
    assert zfcal("analyse", other).code == 0
    assert zfcal("calibrate", other, *slow).code == 0
    assert watching.contents(trial) == watching.contents(other)


@pytest.mark.slow
def test_a_half_written_file_is_named_and_passed_over_until_it_is_whole(watching, live, trial):
    """Without a dot in its name, as a careless copy leaves it."""
    root, bring = live
    bring(0, 60, 120, 180)
    path = root / "tracks" / "000060.parquet"
    whole = path.read_bytes()
    path.write_bytes(whole[:2000])
    with watching.start(root, *watching.quick) as watch:
        named = watch.until("unfinished")
        assert named["path"] == str(path)
        assert "2000 bytes, and no footer" in named["problem"]
        path.write_bytes(whole)
        watch.until("arrived", path=str(path))
        assert watch.wait() == 0
    assert (root / "models" / "000120.toml").exists()
    assert (root / "models" / "000180.toml").exists()


@pytest.mark.slow
def test_one_that_stays_half_written_is_exit_code_3(process, watching, live):
    """All else is done."""
    root, bring = live
    bring(0, 60, 120, 180)
    path = root / "tracks" / "000120.parquet"
    path.write_bytes(path.read_bytes()[:2000])
    done = process("watch", root, "--once", *watching.quick)
    assert done.code == 3
    assert f"zfcal: left out: {path}: is not whole: 2000 bytes, and no footer." in done.err
    assert (root / "models" / "000120.toml").exists()


@pytest.mark.slow
def test_a_trial_that_goes_away_is_waited_for(watching, live):
    """A disk that is mounted again, a folder that was moved by mistake."""
    root, bring = live
    with watching.start(root, "--poll", *watching.quick) as watch:
        watch.until("began", polls="--poll was given")
        away = root.rename(root.with_name("away"))
        watch.until("gone")
        away.rename(root)
        watch.until("back")
        bring(0, 60, 120, 180)
        assert watch.wait() == 0
    assert (root / "models" / "000180.toml").exists()


@pytest.mark.slow
def test_what_fails_is_said_and_tried_again(watching, live):
    """Settings that somebody is editing: a mistake, and its correction."""
    root, bring = live
    right = (root / "trial.toml").read_text()
    with watching.start(root, *watching.quick) as watch:
        watch.until("began")
        (root / "trial.toml").write_text(right.replace("fps", "fsp"))
        bring(0, 60, 120, 180)
        failed = watch.until("failed", stage="analyse")
        assert "fsp" in failed["problem"]
        (root / "trial.toml").write_text(right)
        assert watch.wait() == 0
    assert (root / "models" / "000180.toml").exists()


def test_a_dry_run_says_what_each_stage_would_make(zfcal, trial):
    """The windows that are there; nothing is written, no process starts, no lock lies there."""
    before = sorted(trial.rglob("*"))
    done = zfcal("watch", "trial", "--dry-run")
    assert done.code == 0
    assert "watch would run analyse, calibrate in trial." in done.err
    assert "would make trial/stats/000120.parquet: missing" in done.err
    assert "would make trial/stats/000180.parquet: missing" in done.err
    assert "calibrate: nothing to make now" in done.err
    assert sorted(trial.rglob("*")) == before


def test_a_dry_run_says_where_the_page_would_be(zfcal, trial):
    """Without stages too: then it would run none."""
    done = zfcal("watch", "trial", "--view", "--stages", "none", "--dry-run")
    assert done.code == 0
    assert "watch would run no stage in trial." in done.err
    assert "would show the trial on a page, at port 8642 of this computer." in done.err
    done = zfcal("watch", "trial", "--view", "--view-port", "0", "--dry-run")
    assert "watch would run analyse, calibrate in trial." in done.err
    assert "on a page, at a free port of this computer." in done.err
    assert "on a page" not in zfcal("watch", "trial", "--dry-run").err


@pytest.mark.slow
def test_a_dry_run_takes_no_round_with_a_budget_for_stale(zfcal, trial):
    """Such a round is made once, whatever its inputs; one with generations is made again."""
    assert zfcal("analyse", "trial").code == 0
    made = zfcal("calibrate", "trial", "--generations", 1, "--publish", "score")
    assert made.code == 0, made.err
    changed = ("--publish", "score", "--dry-run", "--json")
    kept = json.loads(zfcal("watch", "trial", "--budget", "5s", *changed).out)
    reasons = [each["reason"] for each in kept["artifacts"]]
    again = json.loads(zfcal("watch", "trial", "--generations", 2, *changed).out)
    states = [
        {Path(each["path"]).name: each["state"] for each in told["artifacts"]}
        for told in (kept, again)
    ]
    assert [state["000120.toml"] for state in states] == ["up to date", "planned"], reasons


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["--stages", "analyze"], "'analyze' is none of track, analyse, calibrate"),
        (["--stages", "analyse", "--budget", "20s"], "--budget belongs to calibrate"),
        (["--stages", "calibrate", "--control", "."], "--control belongs to analyse"),
        (["--stages", "calibrate", "--overhead", "0"], "--overhead belongs to track"),
        (["--budget", "20s", "--generations", "3"], "give one"),
        (["--champion", "likely", "--no-seed-likelihood"], "--publish likelihood is the estimate"),
        (["--publish", "score", "--champion", "likely"], "say the same: give one"),
        (["--stages", "analyse", "--publish", "score"], "--publish belongs to calibrate"),
        (["--stages", "analyse", "--champion", "likely"], "--champion belongs to calibrate"),
        (["--once", "--until-idle", "3s"], "give one"),
    ],
)
def test_what_cannot_take_effect_is_wrong_usage(zfcal, trial, words, says):
    """Exit code 2, and which stage it belongs to."""
    done = zfcal("watch", "trial", *words)
    assert done.code == 2
    assert says in done.err


def test_a_trial_that_is_not_there_is_an_error(zfcal):
    """As for every other command."""
    done = zfcal("watch", "nowhere", "--once")
    assert done.code == 1
    assert "nowhere" in done.err
