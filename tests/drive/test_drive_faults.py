"""The driver as a process, on a live trial, while things go wrong."""

import contextlib
import importlib.util
import json
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from zfcal.artifacts.drive_files import drive_files, read_drive
from zfcal.artifacts.mcap_files import overview
from zfcal.artifacts.validation import check
from zfcal.drive.models import DriveModels
from zfcal.drive.pilot import Manner, Pilot
from zfcal.drive.replay import replay
from zfcal.errors import LockedError
from zfcal.robot.aseba import Decoder
from zfcal.robot.fishbot import FishBot
from zfcal.robot.stop_guard import RESYNC
from zfcal.robot.virtual_process import VirtualProcess
from zfcal.stages.events import say_nothing
from zfcal.stages.trial_context import open_trial
from zfcal_cli.main import run as zfcal

_spec = importlib.util.spec_from_file_location("driven", Path(__file__).with_name("driven.py"))
driven = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(driven)

BRIEF = Path(__file__).parents[1] / "brief.py"
STOP = "000000000100"
VOID = {frame.encode().hex() for frame in Decoder().feed(RESYNC)} - {STOP}
"""What a robot makes of the resynchronisation, without the STOP at its end."""

KILLS = 20
SECONDS = 40


@pytest.fixture(scope="module")
def template(tmp_path_factory):
    """Return a trial and frames for it."""
    root = driven.make_trial(tmp_path_factory.mktemp("live") / "trial")
    opened = open_trial(root)
    # Compiled here once, not by each driver while its robot waits.
    Pilot(opened, Manner(), FishBot("F", None)).warm_up(DriveModels(opened).first())
    return root, driven.frames_of(root, SECONDS)


class Rig:
    """A live trial, a virtual robot and drivers of it."""

    def __init__(self, root, frames, forks):
        self.root = root
        self.forks = forks
        self.robot = VirtualProcess()
        self.poses = driven.LivePoses(root, frames)
        self.drivers = []
        self._heard = []
        self._lines = root.parent / "told.jsonl"
        self._said = root.parent / "said.txt"

    def start(self, *words):
        """Start a driver that has loaded all it needs."""
        command = ("drive", self.root, "--port", self.robot.port, "--events", *words)
        self.forks.start(self.root.parent, *command, out=self._lines, err=self._said)

    def said(self):
        """Return what that driver has said by now."""
        return self._said.read_text()

    def start_anew(self):
        """Start a driver as a process of its own, as people do."""
        command = [sys.executable, "-m", "zfcal_cli.main", "drive", str(self.root)]
        command += ["--port", str(self.robot.port), "--events"]
        with self._lines.open("a") as lines:
            driver = subprocess.Popen(command, stdout=lines, stderr=subprocess.PIPE, text=True)
        self.drivers.append(driver)
        return driver

    def told(self, event):
        """Return what was told of a kind, as lines of JSON."""
        lines = map(json.loads, self._lines.read_text().splitlines())
        return [line for line in lines if line["event"] == event]

    def heard(self):
        """Return all that the robot has heard and knows, as times and frames."""
        found = [tuple(pair) for pair in self.robot.control.ask("heard")["heard"]]
        self._heard += [(time_s, frame) for time_s, frame in found if frame not in VOID]
        return self._heard

    def moves(self):
        """Return how many wheel speeds it has heard."""
        return sum(frame.startswith("040000000b") for _, frame in self.heard())

    def items(self, what):
        """Return what is logged of a kind."""
        files = drive_files(self.root).values()
        return [item for path in files for item in read_drive(path) if item["what"] == what]

    def until(self, holds, patience_s=30.0):
        """Wait until something holds."""
        end_s = time.monotonic() + patience_s
        while not (found := holds()):
            assert time.monotonic() < end_s, "it never came to that"
            time.sleep(0.02)
        return found

    def wheels(self):
        """Return how fast the wheels turn."""
        at = self.robot.control.ask("pose")
        return abs(at["left_m_s"]) + abs(at["right_m_s"])

    def end(self):
        """Let the driver end by itself."""
        self.forks.send_signal(signal.SIGTERM)
        assert self.forks.code(10) == 143

    def close(self):
        """End everything."""
        if self.forks.is_running:
            self.forks.kill()
        for driver in self.drivers:
            with contextlib.suppress(ProcessLookupError):
                driver.kill()
            driver.wait()
            driver.stderr.close()
        if self._lines.exists():
            for line in self._lines.read_text().splitlines():
                check(json.loads(line), "drive-event", "a line")
        self.robot.control.close()
        self.robot.close()


@pytest.fixture(scope="module")
def forks(forking):
    """Return what runs drivers that have loaded what they need."""
    with forking.Forks() as made:
        yield made


@pytest.fixture
def rig(template, forks, tmp_path):
    """Return a rig whose poses have begun."""
    made = Rig(Path(shutil.copytree(template[0], tmp_path / "trial")), template[1], forks)
    with made.poses:
        yield made
    made.close()


@pytest.mark.slow
def test_silence_stops_the_robot_and_it_goes_on(rig):
    """STOP within 0.6 s of the last pose; no wheel turns until poses come again; all is logged."""
    rig.start()
    rig.until(lambda: rig.moves() > 10)
    rig.poses.freeze()
    frozen_s = rig.robot.control.ask("pose")["time_s"]
    rig.until(lambda: rig.heard()[-1][1] == STOP)
    first_s = next(t for t, frame in rig.heard() if frame == STOP and t > frozen_s)
    assert first_s - frozen_s < 0.7
    time.sleep(0.5)
    assert rig.wheels() == 0.0
    assert {frame for t, frame in rig.heard() if t > first_s} == {STOP}
    moves = rig.moves()
    rig.poses.thaw()
    rig.until(lambda: rig.moves() > moves + 5)
    for found in (rig.items("fault"), rig.told("fault")):
        faults = [(f["fault"], f["ended"]) for f in found]
        assert ("stale-pose", False) in faults
        assert ("stale-pose", True) in faults
    # Its steps are those of five targets a second.
    missed = [told for told in rig.told("missed") if told["because"] == "no frame came in time"]
    assert [told["steps"] >= 3 for told in missed] == [True]


@pytest.mark.slow
@pytest.mark.parametrize(("number", "code"), [(signal.SIGTERM, 143), (signal.SIGINT, 130)])
def test_stop_is_the_last_word_on_a_signal(rig, number, code):
    """And the log is whole, and a replay comes to the same."""
    driver = rig.start_anew()
    rig.until(lambda: rig.moves() > 10)
    driver.send_signal(number)
    assert driver.wait(10) == code
    rig.until(lambda: rig.heard()[-1][1] == STOP and rig.wheels() == 0.0)
    files = list(drive_files(rig.root).values())
    assert all(overview(path).whole for path in files)
    assert replay(rig.root, say_nothing).is_same
    assert rig.told("ended")[0]["because"] == {143: "SIGTERM", 130: "Ctrl-C"}[code]


@pytest.mark.slow
def test_a_driver_that_is_killed_has_its_last_word_and_goes_on(rig, forks):
    """By SIGKILL, twenty times at random instants, from its start on: the robot stops each time.

    A new driver adds to the same log, which loses nothing but what passed meanwhile.
    """
    rng = np.random.default_rng(7)
    kept = []
    for number in range(KILLS):
        moves = rig.moves()
        forks.start(rig.root.parent, "drive", rig.root, "--port", rig.robot.port)
        if number % 2 == 0:
            rig.until(lambda moves=moves: rig.moves() > moves + 3)
        time.sleep(rng.uniform(0.0, 0.6))
        assert not forks.kill()
        rig.until(lambda: rig.wheels() == 0.0, 5.0)
        # One that was killed before it moved anything has nothing to stop.
        rig.until(
            lambda moves=moves: (
                rig.heard()[-1:] == [] or rig.heard()[-1][1] == STOP or rig.moves() == moves
            )
        )
        found = rig.items("command")
        assert found[: len(kept)] == kept
        kept = found
    assert len(kept) >= 50
    rig.start()
    moves = rig.moves()
    rig.until(lambda: rig.moves() > moves + 10)
    rig.end()
    after = rig.items("command")
    assert after[: len(kept)] == kept
    assert len(after) > len(kept) + 8
    assert len([m for m in rig.items("model") if m["begins"]]) >= 4
    assert all(overview(path).whole for path in drive_files(rig.root).values())
    assert replay(rig.root, say_nothing).is_same


@pytest.fixture
def small_disk(rig):
    """Return the drive's folder, on a file system of 2 MB of its own."""
    place = rig.root / "drive"
    place.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=2m", "zfcal-test", str(place)]
    if subprocess.run(mount, capture_output=True, check=False).returncode:
        pytest.skip("a file system of 2 MB cannot be mounted here (needs root)")
    yield place
    subprocess.run(["umount", "-l", str(place)], check=True)


@pytest.mark.slow
def test_a_disk_that_is_full_keeps_nobody_from_driving(rig, small_disk):
    """It is said; the robot is driven on; with room again the log lacks not a tick."""
    rig.start()
    rig.until(lambda: rig.moves() > 5)
    filler = small_disk / "filler"
    with filler.open("wb", buffering=0) as file, contextlib.suppress(OSError):
        while True:
            file.write(bytes(4096))
    moves = rig.moves()
    rig.until(lambda: rig.moves() > moves + 25)
    filler.unlink()
    rig.until(lambda: [f["ended"] for f in rig.items("fault") if f["fault"] == "log"])
    rig.end()
    assert [f["ended"] for f in rig.items("fault") if f["fault"] == "log"] == [False, True]
    said = rig.said()
    assert "No space left on device" in said
    assert "the robot is driven on" in said
    times = [c["time_s"] for c in rig.items("command")]
    assert np.diff(times).max() < 0.35
    assert all(overview(path).whole for path in drive_files(rig.root).values())
    assert replay(rig.root, say_nothing).is_same


@pytest.mark.slow
@pytest.mark.apt
def test_a_clock_that_is_set_by_an_hour_changes_nothing(rig, set_clock):
    """Forwards and back while it drives: no STOP, no tick left out, no latency of an hour."""
    driver = rig.start_anew()
    for offset in ("+3600", "-3600"):
        moves = rig.moves()
        # The driver has the new time after a second.
        rig.until(lambda moves=moves: rig.moves() > moves + 15)
        set_clock(offset)
    moves = rig.moves()
    rig.until(lambda: rig.moves() > moves + 15)
    # The library that sets the clock breaks the wait for a process that ends.
    driver.kill()
    assert "stopped" not in driver.stderr.read()
    assert rig.items("fault") == []
    assert np.diff([c["time_s"] for c in rig.items("command")]).max() < 0.35


@pytest.mark.slow
def test_unplugged_and_back(rig):
    """While the port is gone nothing is sent, which is said; afterwards it drives on by itself."""
    rig.start()
    rig.until(lambda: rig.moves() > 5)
    rig.robot.control.ask("unplug")
    rig.until(lambda: any(f["fault"] == "port-lost" for f in rig.items("fault")))
    time.sleep(0.5)
    moves = rig.moves()
    rig.robot.control.ask("plug")
    rig.until(lambda: rig.moves() > moves + 10)
    lost = [c for c in rig.items("command") if c["held"] == "port-lost"]
    assert len(lost) >= 4
    assert not any(c["sent"] for c in lost)
    rig.end()
    told = [(t["fault"], t["ended"]) for t in rig.told("fault")]
    assert [t for t in told if t[0] == "port-lost"] == [("port-lost", False), ("port-lost", True)]
    assert replay(rig.root, say_nothing).is_same


ROUND = ("--generations", "1", "--population", "4", "--steps", "20", "--no-seed-likelihood", "-q")
NEW = "models/000120.toml"


@pytest.fixture
def analysed(template, tmp_path):
    """Return a trial with the statistics of a window; all that a round needs is compiled."""
    root = Path(shutil.copytree(template[0], tmp_path / "analysed"))
    model = str(root / "models" / "000000.toml")
    for name, *words in (
        ("simulate", "--model", model, "--duration", "120", "-q"),
        ("analyse", "-q"),
        ("calibrate", *ROUND),
    ):
        assert zfcal([name, str(root), *words]) == 0
    return root


@pytest.mark.slow
def test_new_parameters_drive_within_a_second_of_their_making(analysed, rig):
    """By `zfcal calibrate` beside it, in real time; a broken model is told and ignored."""
    for folder in ("tracks", "stats"):
        shutil.copytree(analysed / folder, rig.root / folder)
    rig.start()
    rig.until(lambda: rig.moves() > 5)
    words = [sys.executable, str(BRIEF), "calibrate", str(rig.root), *ROUND]
    calibrating = subprocess.Popen(words)
    made = rig.root / "models" / "000120.toml"
    rig.until(made.exists, 60)
    made_s = rig.robot.control.ask("pose")["time_s"]
    target = rig.until(lambda: [t for t in rig.items("target") if t["model"] == NEW], 5)[0]

    def moves():
        return [c for c in rig.items("command") if c["sent"] and c["event"] != "STOP"]

    rig.until(lambda: [c for c in moves() if c["step"] >= target["step"]])
    first = next(k for k, c in enumerate(moves()) if c["step"] >= target["step"])
    # When the robot heard that command, by its own clock.
    rig.until(lambda: rig.moves() > first)
    heard = [t for t, frame in rig.heard() if frame.startswith("040000000b")]
    assert heard[first] - made_s < 1.0
    assert calibrating.wait(60) == 0
    (rig.root / "models" / "000180.toml").write_text("half of it = ")
    rig.until(lambda: any(f["fault"] == "model" for f in rig.items("fault")))
    moves = rig.moves()
    rig.until(lambda: rig.moves() > moves + 5)
    assert rig.items("target")[-1]["model"] == NEW
    rig.end()
    said = rig.said()
    assert [t["model"] for t in rig.told("model")] == ["models/000000.toml", NEW]
    assert "models/000120.toml drives" in said
    assert "000180.toml" in said


@pytest.mark.slow
def test_poses_of_images_that_are_old_are_not_driven_by(rig):
    """The tracker falls 2 s behind and writes on: STOP; when it has caught up the robot goes on."""
    rig.start()
    rig.until(lambda: rig.moves() > 10)
    rig.poses.behind_s = 2.0
    rig.until(lambda: any(f["fault"] == "stale-pose" for f in rig.items("fault")))
    # Frames come again at their rate by now, each of them two seconds late.
    time.sleep(2.5)
    moves, n_frames = rig.moves(), len(rig.items("pose"))
    time.sleep(0.5)
    assert len(rig.items("pose")) > n_frames
    assert rig.moves() == moves
    assert rig.wheels() == 0.0
    rig.poses.behind_s = 0.0
    rig.until(lambda: rig.moves() > moves + 5)


@pytest.mark.slow
def test_what_the_robot_complains_of_is_heard(rig):
    """Obstacle: it turns on the spot for half a second; PowerDown for 3 s: it is stopped."""
    rig.start()
    rig.until(lambda: rig.moves() > 5)
    rig.robot.control.ask("obstacle")
    rig.until(lambda: any(f["fault"] == "obstacle" and f["ended"] for f in rig.items("fault")))
    turned = [c for c in rig.items("command") if c["held"] == "obstacle"]
    assert 4 <= len(turned) <= 7
    assert all(abs(c["left_m_s"] + c["right_m_s"]) < 1e-12 for c in turned)
    rig.robot.control.ask("power-down", for_s=4.0)
    rig.until(lambda: any(f["fault"] == "power-down" and f["ended"] for f in rig.items("fault")))
    began, ended = [f["time_s"] for f in rig.items("fault") if f["fault"] == "power-down"]
    assert 1.0 < ended - began < 3.0
    assert {c["bytes"] for c in rig.items("command") if c["held"] == "power-down"} == {STOP}
    rig.end()
    assert replay(rig.root, say_nothing).is_same


def start_hanging(rig, method, *, call):
    """Start a driver of which one method takes 1.5 s, once, and says so; return it."""
    module, owner, name = method.rsplit(".", 2)
    program = (
        "import sys, time\n"
        f"from {module} import {owner}\n"
        "from zfcal_cli.main import run\n"
        f"was, calls = {owner}.{name}, []\n"
        "def hang(self):\n"
        "    calls.append(was(self))\n"
        f"    if len(calls) == {call}:\n"
        "        time.sleep(1.5)\n"
        "        print('It hung.', file=sys.stderr)\n"
        f"{owner}.{name} = hang\n"
        "sys.exit(run(['drive', *sys.argv[1:]]))\n"
    )
    command = [sys.executable, "-c", program, str(rig.root), "--port", str(rig.robot.port)]
    rig.drivers.append(subprocess.Popen(command, stderr=subprocess.PIPE, text=True))
    return rig.drivers[-1]


@pytest.mark.slow
def test_a_disk_that_is_slow_holds_up_the_log_alone(rig):
    """A write takes 1.5 s: not a tick is left out meanwhile, and all of it is written then."""
    driver = start_hanging(rig, "zfcal.drive.log.DriveLog._write", call=40)
    rig.until(lambda: rig.moves() > 45)
    driver.send_signal(signal.SIGTERM)
    assert driver.wait(10) == 143
    times = [c["time_s"] for c in rig.items("command")]
    assert np.diff(times).max() < 0.35
    assert rig.items("fault") == []
    said = driver.stderr.read()
    assert "It hung." in said
    assert "held up" not in said
    assert replay(rig.root, say_nothing).is_same


@pytest.mark.slow
def test_the_watchdog_stops_the_robot_of_a_driver_that_hangs(rig):
    """Its main thread waits for something for 1.5 s: STOP comes in time, from the other thread."""
    driver = start_hanging(rig, "zfcal.drive.driving.Driver.tick", call=150)
    rig.until(lambda: any(f["fault"] == "watchdog" for f in rig.items("fault")))
    moves = rig.moves()
    rig.until(lambda: rig.moves() > moves + 5)
    times = [t for t, frame in rig.heard() if frame.startswith("040000000b")]
    gap = max(range(1, len(times)), key=lambda k: times[k] - times[k - 1])
    stops = [t for t, frame in rig.heard() if frame == STOP and times[gap - 1] < t < times[gap]]
    assert stops
    assert stops[0] - times[gap - 1] < 0.65
    driver.kill()
    assert "steps of the model were missed: the driver was held up." in driver.stderr.read()


@pytest.mark.slow
def test_a_second_driver_is_refused_and_a_port_that_is_not_there(
    rig, tmp_path, capsys, monkeypatch
):
    """Exit 75 and exit 1, each with a line that says why."""
    rig.start()
    rig.until(lambda: rig.moves() > 2)
    second = rig.start_anew()
    assert second.wait(20) == 75
    with pytest.raises(LockedError):
        replay(rig.root, say_nothing)
    other = driven.make_trial(tmp_path / "other")
    monkeypatch.setattr("zfcal.drive.drive._OPENING_S", 0.2)
    assert zfcal(["drive", str(other), "--port", "/dev/nobody"]) == 1
    said = capsys.readouterr().err
    assert "/dev/nobody: the port cannot be opened" in said
    assert "Traceback" not in said


@pytest.mark.slow
def test_events_are_told_as_lines_of_json(rig):
    """From its beginning to its end: by whom and by what it drives, how quick it was."""
    rig.start("--duration", "2s", "--pattern", "pid", "-q")
    assert rig.forks.code(30) == 0
    (began,), (ended,) = rig.told("began"), rig.told("ended")
    assert (began["pattern"], began["port"]) == ("pid", str(rig.robot.port))
    assert ended["because"] == "the duration is over"
    assert [told["robot"] for told in rig.told("answered")] == ["F"]
    assert [told["model"] for told in rig.told("model")] == ["models/000000.toml"]
    result = rig.told("result")[0]["value"]
    assert result["commands"] >= 15
    assert result["latency"]["tick_to_byte_s"]["n"] >= 15
    assert result["latency"]["pose_to_state_s"]["n"] >= 20
    assert [Path(told["path"]).name for told in rig.told("made")] == ["000000.mcap"]
    assert rig.said() == ""
    assert Path(rig.told("made")[0]["path"]).exists()


@pytest.mark.slow
def test_the_end_is_told_as_json(rig, tmp_path):
    """One document: what was made, how quick it was; the driver ends after --duration."""
    words = ("--json", "-q", "--port", rig.robot.port, "--duration", "2s", "--pattern", "pid")
    out = tmp_path / "end.json"
    rig.forks.start(tmp_path, "drive", rig.root, *words, out=out)
    assert rig.forks.code(30) == 0
    document = json.loads(out.read_text())
    (result,) = document["results"]
    assert result["commands"] >= 15
    assert result["latency"]["tick_to_byte_s"]["n"] >= 15
    assert result["latency"]["pose_to_state_s"]["n"] >= 20
    assert [Path(a["path"]).name for a in document["artifacts"]] == ["000000.mcap"]
    assert Path(document["artifacts"][0]["path"]).exists()
