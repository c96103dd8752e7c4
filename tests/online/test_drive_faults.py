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

import pytest

from zfcal.artifacts.drive_files import drive_files, read_drive
from zfcal.artifacts.mcap_files import overview
from zfcal.errors import LockedError
from zfcal.online.drive_replay import replay
from zfcal.online.events import say_nothing
from zfcal.robot.virtual_process import VirtualProcess

_spec = importlib.util.spec_from_file_location("driven", Path(__file__).with_name("driven.py"))
driven = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(driven)

STOP = "000000000100"
SECONDS = 40


@pytest.fixture(scope="module")
def template(tmp_path_factory):
    """Return a trial and frames for it."""
    root = driven.make_trial(tmp_path_factory.mktemp("live") / "trial")
    return root, driven.frames_of(root, SECONDS)


class Rig:
    """A live trial, a virtual robot and drivers of it."""

    def __init__(self, root, frames):
        self.root = root
        self.robot = VirtualProcess()
        self.poses = driven.LivePoses(root, frames)
        self.drivers = []
        self._heard = []

    def start(self, *words):
        """Start a driver as a process."""
        command = [sys.executable, "-m", "zfcal_cli.main", "drive", str(self.root)]
        command += ["--port", str(self.robot.port), *words]
        self.drivers.append(subprocess.Popen(command, stderr=subprocess.PIPE, text=True))
        return self.drivers[-1]

    def heard(self):
        """Return all that the robot has heard, as times and frames."""
        self._heard += [tuple(pair) for pair in self.robot.control.ask("heard")["heard"]]
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
        self.drivers[-1].send_signal(signal.SIGTERM)
        assert self.drivers[-1].wait(10) == 143

    def close(self):
        """End everything."""
        for driver in self.drivers:
            with contextlib.suppress(ProcessLookupError):
                driver.kill()
            driver.wait()
            driver.stderr.close()
        self.robot.control.close()
        self.robot.close()


@pytest.fixture
def rig(template, tmp_path):
    """Return a rig whose poses have begun."""
    made = Rig(Path(shutil.copytree(template[0], tmp_path / "trial")), template[1])
    with made.poses:
        yield made
    made.close()


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
    faults = [(f["fault"], f["ended"]) for f in rig.items("fault")]
    assert ("stale-pose", False) in faults
    assert ("stale-pose", True) in faults


@pytest.mark.parametrize(("number", "code"), [(signal.SIGTERM, 143), (signal.SIGINT, 130)])
def test_stop_is_the_last_word_on_a_signal(rig, number, code):
    """And the log is whole, and a replay comes to the same."""
    if signal.getsignal(number) is signal.SIG_IGN:
        pytest.skip("whoever runs the tests ignores Ctrl-C, as a shell does in the background")
    driver = rig.start()
    rig.until(lambda: rig.moves() > 10)
    driver.send_signal(number)
    assert driver.wait(10) == code
    rig.until(lambda: rig.heard()[-1][1] == STOP and rig.wheels() == 0.0)
    files = list(drive_files(rig.root).values())
    assert all(overview(path).whole for path in files)
    assert replay(rig.root, say_nothing).is_same


def test_a_driver_that_was_killed_has_its_last_word_and_goes_on(rig):
    """By SIGKILL: the robot stops; a new driver adds to the same log, which loses nothing."""
    driver = rig.start()
    rig.until(lambda: rig.moves() > 15)
    driver.kill()
    rig.until(lambda: rig.heard()[-1][1] == STOP and rig.wheels() == 0.0, 5.0)
    before = rig.items("command")
    assert len(before) >= 10
    second = rig.start()
    moves = rig.moves()
    rig.until(lambda: rig.moves() > moves + 10)
    second.send_signal(signal.SIGTERM)
    assert second.wait(10) == 143
    after = rig.items("command")
    assert after[: len(before)] == before
    assert len(after) > len(before) + 8
    assert len([m for m in rig.items("model") if m["begins"]]) == 2
    assert all(overview(path).whole for path in drive_files(rig.root).values())
    assert replay(rig.root, say_nothing).is_same


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
    assert replay(rig.root, say_nothing).is_same


def test_new_parameters_drive_within_a_step(rig):
    """Written whole by another process; a broken one is told and ignored."""
    driver = rig.start()
    rig.until(lambda: rig.moves() > 5)
    driven.add_model(rig.root, 120)
    written_s = rig.items("command")[-1]["time_s"]
    rig.until(lambda: len(rig.items("model")) == 2)
    assert rig.items("model")[-1]["time_s"] - written_s < 0.45
    (rig.root / "models" / "000180.toml").write_text("half of it = ")
    rig.until(lambda: any(f["fault"] == "model" for f in rig.items("fault")))
    moves = rig.moves()
    rig.until(lambda: rig.moves() > moves + 5)
    assert rig.items("target")[-1]["model"] == "models/000120.toml"
    driver.send_signal(signal.SIGTERM)
    assert driver.wait(10) == 143
    said = driver.stderr.read()
    assert "models/000120.toml drives" in said
    assert "000180.toml" in said


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


def test_the_watchdog_stops_the_robot_of_a_driver_that_hangs(rig):
    """Its main thread waits for a disk for 1.5 s: STOP comes in time, from the other thread."""
    program = (
        "import sys, time\n"
        "from zfcal.online import drive_log\n"
        "from zfcal_cli.main import run\n"
        "flush, calls = drive_log.DriveLog.flush, []\n"
        "def hang(self):\n"
        "    calls.append(flush(self))\n"
        "    if len(calls) == 150:\n"
        "        time.sleep(1.5)\n"
        "drive_log.DriveLog.flush = hang\n"
        "sys.exit(run(['drive', *sys.argv[1:]]))\n"
    )
    command = [sys.executable, "-c", program, str(rig.root), "--port", str(rig.robot.port)]
    rig.drivers.append(subprocess.Popen(command, stderr=subprocess.PIPE, text=True))
    rig.until(lambda: any(f["fault"] == "watchdog" for f in rig.items("fault")))
    moves = rig.moves()
    rig.until(lambda: rig.moves() > moves + 5)
    times = [t for t, frame in rig.heard() if frame.startswith("040000000b")]
    gap = max(range(1, len(times)), key=lambda k: times[k] - times[k - 1])
    stops = [t for t, frame in rig.heard() if frame == STOP and times[gap - 1] < t < times[gap]]
    assert stops
    assert stops[0] - times[gap - 1] < 0.65


def test_a_second_driver_is_refused_and_a_port_that_is_not_there(rig, tmp_path):
    """Exit 75 and exit 1, each with a line that says why."""
    rig.start()
    rig.until(lambda: rig.moves() > 2)
    second = rig.start()
    assert second.wait(20) == 75
    with pytest.raises(LockedError):
        replay(rig.root, say_nothing)
    other = driven.make_trial(tmp_path / "other")
    words = [sys.executable, "-m", "zfcal_cli.main", "drive", str(other), "--port", "/dev/nobody"]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert "/dev/nobody: the port cannot be opened" in done.stderr
    assert "Traceback" not in done.stderr


def test_the_end_is_told_as_json(rig):
    """One document: what was made, how quick it was; the driver ends after --duration."""
    words = [sys.executable, "-m", "zfcal_cli.main", "drive", str(rig.root), "--json", "-q"]
    words += ["--port", str(rig.robot.port), "--duration", "2s", "--pattern", "pid"]
    done = subprocess.run(words, capture_output=True, text=True, check=True)
    document = json.loads(done.stdout)
    (result,) = document["results"]
    assert result["commands"] >= 15
    assert result["latency"]["tick_to_byte_s"]["n"] >= 15
    assert result["latency"]["pose_to_state_s"]["n"] >= 20
    assert [Path(a["path"]).name for a in document["artifacts"]] == ["000000.mcap"]
    assert Path(document["artifacts"][0]["path"]).exists()
