"""What befalls a rig, with the real command: kills, a full disk, a clock that jumps, late files."""

import os
import shutil
import signal
import subprocess
import time
from pathlib import Path

import numpy as np
import pytest

from zfcal_cli.main import run

ROUND = ("--generations", "4", "--population", "12", "--steps", "200", "--seed", "1")
ROUND += ("--no-seed-likelihood",)
"""A round of about a second, so that kills fall into searches, conclusions and writes."""

NAMES = {"trial", "tracks.csv"}


@pytest.fixture(scope="module")
def made(tmp_path_factory, write_tracks, watching):
    """Return a folder with a trial that waits for its four minutes and a part, these, and the end.

    The end are the artifacts that one command after the other makes.
    """
    place = tmp_path_factory.mktemp("made")
    write_tracks(place / "tracks.csv", seconds=250)
    tank = ("--side-m", "1", "--fish", "3", "--robot", "--fps", "5")
    for words in (
        ("init", "trial", *tank),
        ("import", "tracks.csv", "trial", "--format", "csv"),
        ("analyse", "trial"),
        ("calibrate", "trial", *ROUND),
    ):
        assert run([words[0], *(str(place / w) if w in NAMES else w for w in words[1:]), "-q"]) == 0
    end = watching.contents(place / "trial")
    shutil.move(place / "trial" / "tracks", place / "waiting")
    for folder in ("stats", "scores"):
        shutil.rmtree(place / "trial" / folder)
    for path in (place / "trial" / "models").glob("0*[1-9]*"):
        path.unlink()
    (place / "trial" / "tracks").mkdir()
    return place, end


@pytest.fixture
def recording(made, tmp_path):
    """Return a trial whose segments wait in the folder beside it."""
    place, _ = made
    shutil.copytree(place / "waiting", tmp_path / "waiting")
    return shutil.copytree(place / "trial", tmp_path / "trial")


@pytest.fixture
def undisturbed(made):
    """Return the artifacts that one command after the other makes."""
    return made[1]


def bring(root, *starts):
    """Bring segments to a trial, as rsync does; all without a number."""
    waiting = root.parent / "waiting"
    for start in starts or range(0, 241, 60):
        name = f"{start:06d}.parquet"
        part = root / "tracks" / f".{name}.Xq1"
        shutil.copy2(waiting / name, part)
        part.rename(root / "tracks" / name)


@pytest.mark.slow
def test_killed_twenty_times_it_ends_in_the_same_bytes(recording, undisturbed, watching):
    """Now the watch itself, now the process of a stage, at random instants of its work."""
    rng = np.random.default_rng(5)
    killed = {"watch": 0, "analyse": 0, "calibrate": 0}
    segments = list(range(0, 241, 60))
    watch = watching.start(recording, *ROUND)
    for number in range(20):
        if number % 4 == 0 and segments[1:]:
            bring(recording, segments.pop(0))
        time.sleep(rng.uniform(0.1, 2.0))
        victim = rng.choice(list(killed))
        if victim == "watch":
            watch.kill()
            watch = watching.start(recording, *ROUND)
        else:
            with watching.no_error():
                os.kill(watch.process_of(victim), signal.SIGKILL)
        killed[victim] += 1
        found = watching.contents(recording)
        assert all(undisturbed[name] == data for name, data in found.items())
    bring(recording, *segments)
    with watch:
        assert watch.wait(120) == 0, watch.said
    assert min(killed.values()) >= 3
    assert watching.contents(recording) == undisturbed
    assert not list(recording.rglob(".*part-*"))


@pytest.fixture
def small_disk(tmp_path):
    """Return a file system of 3 MB."""
    place = tmp_path / "disk"
    place.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=3m", "zfcal-test", str(place)]
    if subprocess.run(mount, capture_output=True, check=False).returncode:
        pytest.skip("a file system of 3 MB cannot be mounted here (needs root)")
    yield place
    subprocess.run(["umount", "-l", str(place)], check=True)


@pytest.mark.slow
def test_a_disk_that_is_full_stops_nothing_for_good(recording, undisturbed, watching, small_disk):
    """Said with what to do; when there is room again, it goes on and ends in the same bytes."""
    root = shutil.copytree(recording, small_disk / "trial")
    shutil.copytree(recording.parent / "waiting", root / "tracks", dirs_exist_ok=True)
    filler = small_disk / "filler"
    with filler.open("wb", buffering=0) as file, watching.no_error():
        while True:
            file.write(bytes(4096))
    with watching.start(root, *ROUND) as watch:
        failed = watch.until("failed", stage="analyse")
        assert "No space left on device" in failed["problem"]
        assert failed["hint"].startswith("The disk is full: make room")
        assert watch.process.poll() is None
        filler.unlink()
        assert watch.wait() == 0
    assert watching.contents(root) == undisturbed


@pytest.mark.slow
def test_segments_out_of_order_end_in_the_same_bytes(recording, undisturbed, watching):
    """What came late is put in, and the rounds after it are made again.

    The files' times are off by an hour and more, as by clocks of other computers:
    that changes nothing.
    """
    for number, path in enumerate(sorted((recording.parent / "waiting").iterdir())):
        then_s = time.time() + (-1) ** number * 3600 * (1 + number)
        os.utime(path, (then_s, then_s))
    with watching.start(recording, *ROUND) as watch:
        bring(recording, 120, 180)
        watch.until("finished", window_end_s=240)
        bring(recording, 0, 240)
        time.sleep(1)
        bring(recording, 60)
        assert watch.wait() == 0
    assert watching.contents(recording) == undisturbed


@pytest.mark.slow
@pytest.mark.apt
def test_a_clock_that_is_set_by_an_hour_changes_nothing(
    recording, undisturbed, watching, set_clock
):
    """Forwards and back while it works: what counts is a clock that nobody sets."""
    with watching.start(recording, *ROUND, "--until-idle", "300s") as watch:
        watch.until("began")
        for offset, starts in (("+3600", (0, 60)), ("-3600", (120, 180))):
            set_clock(offset)
            bring(recording, *starts)
            watch.until("finished", window_end_s=starts[1] + 60)
        bring(recording, 240)
        assert watch.wait() == 0
    assert watching.contents(recording) == undisturbed
    assert max(event["at_s"] for event in watch.events) < 600


@pytest.mark.slow
def test_folders_that_are_moved_away_and_back(recording, undisturbed, watching):
    """The segments vanish for a while; what was made of them stays."""
    with watching.start(recording, *ROUND) as watch:
        bring(recording, 0, 60)
        watch.until("finished", window_end_s=120)
        away = (recording / "tracks").rename(recording.parent / "away")
        time.sleep(1)
        away.rename(recording / "tracks")
        bring(recording, 120, 180, 240)
        assert watch.wait() == 0
    assert watching.contents(recording) == undisturbed


@pytest.mark.slow
def test_the_search_gives_way_to_others(recording, watching):
    """Its process has a lower priority than those of tracker, statistics and robot."""
    with watching.start(recording, *ROUND) as watch:
        watch.until("started", stage="calibrate")
        bring(recording)
        watch.until("takes")
        nice = {
            stage: os.getpriority(os.PRIO_PROCESS, watch.process_of(stage))
            for stage in ("analyse", "calibrate")
        }
        assert nice["calibrate"] == min(nice["analyse"] + 10, 19)


@pytest.mark.slow
def test_stages_die_with_a_watch_that_is_killed(recording, watching):
    """Their locks are free at once for the watch after it."""
    with watching.start(recording, "--generations", "500", *ROUND[2:]) as watch:
        bring(recording)
        watch.until("takes")
        stages = [watch.process_of(stage) for stage in ("analyse", "calibrate")]
        watch.kill()
        ends_s = time.monotonic() + 5
        while any(map(is_running, stages)):
            assert time.monotonic() < ends_s
            time.sleep(0.05)


def is_running(process):
    """Return whether a process is there, and no zombie that nobody has buried yet."""
    try:
        words = Path(f"/proc/{process}/stat").read_text()
    except OSError:
        return False
    return words.rpartition(")")[2].split()[0] != "Z"


@pytest.mark.slow
def test_a_stage_that_fails_to_the_last_is_exit_code_1(recording, watching):
    """Without anything new for a while the watch leaves, and says what is wrong."""
    (recording / "models" / "000000.toml").unlink()
    bring(recording, 0, 60)
    with watching.start(recording, "--until-idle", "4s", *ROUND) as watch:
        assert "000000.toml" in watch.until("failed", stage="calibrate")["problem"]
        assert watch.wait() == 1
    assert "000000.toml" in watch.said
    assert (recording / "stats" / "000120.parquet").exists()
