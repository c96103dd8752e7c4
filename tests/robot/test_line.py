"""The driver and its line, over real pseudo-terminals with a robot that is a process."""

import contextlib
import itertools
import math
import os
import pty
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

from zfcal.errors import InputError
from zfcal.robot import events
from zfcal.robot.aseba import Decoder
from zfcal.robot.body import Pose, Wheels
from zfcal.robot.events import Said
from zfcal.robot.faults import Complaints
from zfcal.robot.fishbot import FishBot, Watchdog
from zfcal.robot.port import SerialLine
from zfcal.robot.simulated import SimulatedFishBot, Traits
from zfcal.robot.stop_guard import RESYNC
from zfcal.robot.virtual_process import Control

STOP = events.stop().encode().hex()
GO = Wheels(left_m_s=0.10, right_m_s=0.12)


VOID = {frame.encode().hex() for frame in Decoder().feed(RESYNC)} - {STOP}
"""What a receiver at the beginning of a frame makes of the resynchronisation, without its STOP."""


def heard(robot):
    """Return the frames that a virtual robot has heard and knows, in hexadecimal."""
    return [frame for _, frame in robot.control.ask("heard")["heard"] if frame not in VOID]


def connected(robot, until, **how):
    """Return an open line to a virtual robot, on which what is sent holds for ever."""
    line = SerialLine(str(robot.port), **how)
    line.beat(math.inf)
    assert until(lambda: line.is_open)
    return line


def drive(bot, wheels=GO):
    """Send wheel speeds; return whether they went."""
    return bot.send(bot.frame_for(wheels))


def test_bytes_go_over_a_real_serial_port(start_virtual, until):
    """The driver asks who is there, the robot answers, and obeys in the published bytes."""
    robot = start_virtual("--noise", "0", "--lag-s", "0")
    bot = FishBot("F", connected(robot, until))
    said = []
    assert until(lambda: said.extend(bot.listen()) or any(s.what == "described" for s in said))
    assert Said(what="described", robot="F", name="Fish_bot_F") in said
    assert drive(bot)
    assert until(lambda: robot.control.ask("pose")["x_m"] > 0.01)
    bot.close()
    assert until(lambda: robot.control.ask("pose")["left_m_s"] == 0.0)
    # First of all what drove before is stopped: by STOP, and once more by the resynchronisation.
    frames = heard(robot)
    assert frames[:2] == [STOP, STOP]
    # A busy machine leaves the robot held for longer: STOP is repeated ten times a second.
    then = list(itertools.dropwhile(lambda frame: frame == STOP, frames))
    assert then[:2] == ["020000" + "0011a00500", "0400000010a023000500"]
    assert then[2] == "040000000b000a000c00"
    assert set(then[3:]) == {STOP}


def test_a_robot_in_steps_moves_when_it_is_told(start_virtual, until):
    """Through process and terminal it ends where the same bytes bring it in memory."""
    robot = start_virtual("--stepped", "--seed", "3", "--noise", "0.1")
    bot = FishBot("F", connected(robot, until, is_lossless=True))
    twin = SimulatedFishBot(Traits(noise=0.1), Pose(x_m=0, y_m=0, heading_rad=0), seed=3)
    for k in range(1, 30):
        frame = bot.frame_for(Wheels(left_m_s=0.1, right_m_s=0.1 + 0.001 * k))
        assert bot.send(frame)
        twin.receive(frame.encode())
        twin.advance(k / 10)
        at = robot.control.ask("advance", to_s=k / 10, received=bot.n_sent)
        assert (at["time_s"], at["x_m"], at["y_m"]) == (twin.time_s, twin.pose.x_m, twin.pose.y_m)
    bot.close()


def test_who_watches_a_robot_is_told_where_it_is(start_virtual, until):
    """A line of JSON every 20 ms, on a connection of its own."""
    robot = start_virtual()
    watcher = Control(robot.socket)
    watcher.ask("watch", every_s=0.02)
    times = [watcher.next()["time_s"] for _ in range(10)]
    watcher.close()
    assert all(0.015 < b - a < 0.3 for a, b in itertools.pairwise(times))
    with pytest.raises(InputError, match="nothing is known"):
        robot.control.ask("dance")


def test_a_robot_that_was_unplugged_is_found_again(start_virtual, until):
    """On another terminal behind the same name; meanwhile nothing is sent, and it is said."""
    robot = start_virtual()
    bot = FishBot("F", connected(robot, until))
    assert drive(bot)
    robot.control.ask("unplug")
    assert until(lambda: not drive(bot))
    assert not bot.line.is_open
    assert bot.line.problem
    robot.control.ask("plug")
    assert until(lambda: drive(bot))
    assert bot.line.n_opened == 2
    bot.listen()
    bot.close()
    assert until(lambda: events.list_nodes().encode().hex() in heard(robot))


WRITER = """
import sys, time
from zfcal.robot.port import SerialLine
line = SerialLine(sys.argv[1])
assert line.wait(5.0)
print("open", flush=True)
end_s, went = time.monotonic() + 3.0, []
while time.monotonic() < end_s:
    went.append(line.write(bytes(10)))
print(went.count(False), line.n_opened, len(went), flush=True)
"""


@pytest.mark.slow
def test_a_driver_that_is_held_up_does_not_lose_its_line():
    """Stopped for longer than a write may take, in the middle of writes, again and again."""
    master, slave = pty.openpty()
    threading.Thread(target=drained, args=(master,), daemon=True).start()
    command = [sys.executable, "-c", WRITER, os.ttyname(slave)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as writer:
        assert writer.stdout.readline() == "open\n"
        while writer.poll() is None:
            writer.send_signal(signal.SIGSTOP)
            time.sleep(0.08)
            writer.send_signal(signal.SIGCONT)
            time.sleep(0.02)
        failed, opened, written = map(int, writer.stdout.readline().split())
    os.close(slave)
    assert written > 100
    assert (failed, opened) == (0, 1)


def drained(master):
    """Read what comes, for ever."""
    with contextlib.suppress(OSError):
        while os.read(master, 65536):
            pass


def test_a_line_that_takes_nothing_is_lost_soon():
    """Nobody reads at the other end: once it is full, a write fails in a fraction of a second."""
    master, slave = pty.openpty()
    line = SerialLine(os.ttyname(slave))
    assert line.wait(5.0)
    for _ in range(100_000):
        began_s = time.monotonic()
        if not line.write(bytes(10)):
            break
    assert time.monotonic() - began_s < 1.0
    assert "timeout" in line.problem
    line.close()
    for end in (master, slave):
        os.close(end)


def test_a_line_that_says_it_takes_bytes_and_takes_none_is_lost(monkeypatch):
    """As a driver may that lacks memory: nobody tries for ever."""
    master, slave = pty.openpty()
    line = SerialLine(os.ttyname(slave))
    assert line.wait(5.0)
    tried = []

    def take_none(*asked):
        tried.append(asked)
        raise BlockingIOError

    with monkeypatch.context() as patch:
        patch.setattr("zfcal.robot.stop_guard.os.write", take_none)
        assert not line.write(bytes(10))
    assert 1 <= len(tried) <= 10
    assert "timeout" in line.problem
    line.close()
    for end in (master, slave):
        os.close(end)


def test_silence_stops_the_robot(line):
    """From its own thread, within half a second and a tick; then nothing but STOP goes out."""
    bot = FishBot("F", line)
    with Watchdog(bot) as watchdog:
        watchdog.fresh()
        began_s = time.monotonic()
        assert drive(bot)
        while bot.is_held is False and time.monotonic() < began_s + 2:
            time.sleep(0.002)
        passed_s = time.monotonic() - began_s
        assert line.sent[-1].hex() == STOP
        assert not drive(bot)
        assert watchdog.n_bites == 1
        watchdog.fresh()
        assert drive(bot)
    assert 0.45 < passed_s < 0.6


def test_before_the_first_pose_nothing_moves(line):
    """A watchdog that never heard of anything fresh holds the robot."""
    bot = FishBot("F", line)
    with Watchdog(bot):
        time.sleep(0.2)
        assert not drive(bot)
    assert set(map(bytes.hex, line.sent)) == {STOP}


def test_what_is_too_fast_is_never_sent(line):
    """Refused, and said."""
    bot = FishBot("F", line)
    with pytest.raises(InputError, match=r"0\.310 m/s"):
        drive(bot, Wheels(left_m_s=0.31, right_m_s=0.0))
    assert line.sent == []


def test_what_rounding_cuts_off_comes_later(line):
    """2.3 cm/s in whole centimetres: 23 cm/s over ten commands."""
    bot = FishBot("F", line)
    sent = [bot.frame_for(Wheels(left_m_s=0.023, right_m_s=-0.023)).arguments for _ in range(10)]
    assert [sum(side) for side in zip(*sent, strict=True)] == [23, -23]
    bot.frame_for(Wheels(left_m_s=0.004, right_m_s=0.0))
    bot.stop_frame()
    assert bot.frame_for(Wheels(left_m_s=0.004, right_m_s=0.0)).arguments == (0, 0)


def test_stop_is_the_last_word_at_the_end(line):
    """Also when something breaks in between."""

    def drive_into_a_bug():
        with FishBot("F", line) as bot:
            drive(bot)
            return 1 / 0

    with pytest.raises(ZeroDivisionError):
        drive_into_a_bug()
    assert line.sent[-1].hex() == STOP
    assert not line.is_open


KILLED = """
import sys, time
from zfcal.robot.body import Wheels
from zfcal.robot.fishbot import FishBot
from zfcal.robot.port import SerialLine
line = SerialLine(sys.argv[1])
line.beat(float("inf"))
line.wait(5)
bot = FishBot("F", line)
while True:
    bot.send(bot.frame_for(Wheels(left_m_s=0.2, right_m_s=0.2)))
    print("sent", flush=True)
    time.sleep(0.05)
"""


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGTERM, signal.SIGSEGV])
def test_stop_is_the_last_word_of_a_driver_that_is_killed(start_virtual, until, number):
    """By a signal that nothing can catch: the small process beside it says STOP."""
    robot = start_virtual()
    words = [sys.executable, "-c", KILLED, str(robot.port)]
    with subprocess.Popen(words, stdout=subprocess.PIPE) as process:
        for _ in range(3):
            process.stdout.readline()
        os.kill(process.pid, number)
        process.wait()
    frames = []
    assert until(lambda: frames.extend(heard(robot)) or frames[-1:] == [STOP])
    assert frames.count("040000000b0014001400") >= 3
    assert until(lambda: robot.control.ask("pose")["left_m_s"] == 0.0)


BEATING = """
import sys, time
from zfcal.robot.body import Wheels
from zfcal.robot.fishbot import FishBot, Watchdog
from zfcal.robot.stop_guard import RESYNC
from zfcal.robot.port import SerialLine
line = SerialLine(sys.argv[1])
line.wait(5)
bot = FishBot("F", line)
with Watchdog(bot) as watchdog:
    while True:
        watchdog.fresh()
        bot.send(bot.frame_for(Wheels(left_m_s=0.2, right_m_s=0.2)))
        print("sent", flush=True)
        time.sleep(0.05)
"""


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGSTOP, signal.SIGTSTP])
def test_a_driver_that_is_stopped_does_not_leave_the_wheels_turning(start_virtual, until, number):
    """By Ctrl-Z or by SIGSTOP: STOP comes when the last pose expires; on SIGCONT it drives on."""
    robot = start_virtual("--noise", "0", "--lag-s", "0")
    words = [sys.executable, "-c", BEATING, str(robot.port)]
    with subprocess.Popen(words, stdout=subprocess.PIPE, process_group=0) as process:
        for _ in range(10):
            process.stdout.readline()
        moving = robot.control.ask("heard")
        os.kill(process.pid, number)
        first = []
        assert until(lambda: first.extend(stops(robot)) or first, patience_s=2.0)
        assert first[0] - moving["heard"][-1][0] < 0.6 + SLACK_S
        assert until(lambda: robot.control.ask("pose")["left_m_s"] == 0.0)
        heard(robot)
        time.sleep(0.35)
        # Again and again: a command that was on its way lasts a tick.
        assert set(found := heard(robot)) == {STOP}
        assert 2 <= len(found) <= 5
        os.kill(process.pid, signal.SIGCONT)
        assert until(lambda: robot.control.ask("pose")["left_m_s"] == pytest.approx(0.2))
        process.kill()


SLACK_S = 0.1
"""The helper is a process among others: it has to get a processor, as has the robot."""


def stops(robot):
    """Return the times at which a virtual robot has heard STOP."""
    return [time_s for time_s, frame in robot.control.ask("heard")["heard"] if frame == STOP]


def test_a_robot_that_still_moves_is_stopped_when_its_port_is_opened(start_virtual, until):
    """By whatever it was driven before, and wherever its receiver stands; and it is held."""
    robot = start_virtual("--noise", "0", "--lag-s", "0")
    port = os.open(robot.port, os.O_RDWR | os.O_NOCTTY)
    os.write(port, events.motor_control("F", 20, 20).encode() + events.list_nodes().encode()[:5])
    assert until(lambda: robot.control.ask("pose")["left_m_s"] == pytest.approx(0.2))
    os.close(port)
    line = SerialLine(str(robot.port))
    assert until(lambda: robot.control.ask("pose")["left_m_s"] == 0.0)
    # Its helper holds it, though nobody has said anything yet.
    heard(robot)
    assert until(lambda: heard(robot).count(STOP) >= 1)
    line.close()


DRIVEN_WELL = """
import sys, time
from zfcal.robot.port import SerialLine
line = SerialLine(sys.argv[1])
line.beat(float("inf"))
line.wait(5)
print(line._helper.pid, flush=True)
time.sleep(60)
"""


def test_the_helper_says_its_last_word_more_than_once_whatever_else_ends(start_virtual, until):
    """A session's or a service's end signals all of its processes: the helper is the last."""
    robot = start_virtual()
    words = [sys.executable, "-c", DRIVEN_WELL, str(robot.port)]
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as process:
        helper = int(process.stdout.readline())
        for number in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP, signal.SIGQUIT):
            os.kill(helper, number)
        time.sleep(0.1)
        heard(robot)
        process.kill()
        process.wait()
        found = []
        assert until(lambda: found.extend(heard(robot)) or found.count(STOP) >= 8)
        assert until(lambda: is_gone(helper))


def is_gone(pid):
    """Return whether a process is no more; of a zombie somebody else takes care."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rsplit(")")[1][1] == "Z"
    except OSError:
        return True


def test_a_driver_that_ends_well_is_not_held_up_by_its_helper(start_virtual, until):
    """One last word is enough where the driver has said STOP itself."""
    robot = start_virtual()
    bot = FishBot("F", connected(robot, until))
    began_s = time.monotonic()
    bot.close()
    assert time.monotonic() - began_s < 0.4


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGSTOP])
def test_a_helper_that_is_lost_is_missed_and_replaced(start_virtual, until, number):
    """Killed, it is missed at the next look; one that hangs, in half a second. STOP is said."""
    robot = start_virtual("--noise", "0", "--lag-s", "0")
    line = connected(robot, until)
    bot = FishBot("F", line)
    assert drive(bot)
    first = line._helper.pid
    os.kill(first, number)
    lost_s = time.monotonic()
    assert until(lambda: not line.is_guarded, patience_s=2.0)
    assert time.monotonic() - lost_s < (0.1 if number == signal.SIGKILL else 0.6) + SLACK_S
    assert until(lambda: line.is_guarded)
    assert line._helper.pid != first
    assert until(lambda: STOP in heard(robot))
    # The new one is as good as the first.
    line.beat(time.monotonic() + 0.1)
    assert drive(bot)
    assert until(lambda: STOP in heard(robot))
    bot.close()


def test_a_helper_that_hears_no_driver_any_more_is_not_left_behind(start_virtual, until):
    """Also one that is stopped itself when the line is closed."""
    robot = start_virtual()
    line = connected(robot, until)
    helper = line._helper.pid
    os.kill(helper, signal.SIGSTOP)
    line.close()
    with pytest.raises(ProcessLookupError):
        os.kill(helper, 0)


def test_wheel_speeds_are_not_sent_when_the_pose_expired_meanwhile(line):
    """Between the decision and the write; if it expired during the write, STOP follows."""
    now_s = [10.0]
    bot = FishBot("F", line, clock=lambda: now_s[0])
    bot.release(10.5)
    frame = bot.frame_for(GO)
    now_s[0] = 10.6
    assert not bot.send(frame)
    assert line.sent == []
    bot.release(11.1)
    write = line.write

    def slow(data):
        now_s[0] += 1.0
        return write(data)

    line.write = slow
    assert bot.send(frame)
    assert [data.hex() for data in line.sent] == [frame.encode().hex(), STOP]
    assert bot.is_held


def test_a_lost_supply_is_one_that_is_told_for_three_seconds():
    """One complaint is none, nor are two a minute apart; it ends when they do."""
    low = Said(what="power-down", robot="F")
    complaints = Complaints("F")
    complaints.hear(low, 0.0)
    complaints.hear(low, 60.0)
    assert complaints.fault(60.1) == ""
    for k in range(16):
        complaints.hear(low, 60.0 + 0.2 * k)
    assert complaints.fault(62.9) == ""
    complaints.hear(low, 63.1)
    assert complaints.fault(63.2) == "power-down"
    assert complaints.fault(64.2) == ""


def test_an_obstacle_clears_after_half_a_second():
    """And another robot's is none of ours."""
    complaints = Complaints("F")
    complaints.hear(Said(what="obstacle", robot="A"), 0.9)
    assert complaints.fault(1.0) == ""
    complaints.hear(Said(what="obstacle", robot="F"), 1.0)
    assert complaints.fault(1.49) == "obstacle"
    assert complaints.fault(1.51) == ""


def test_a_port_that_is_opened_again_has_a_helper_that_knows_until_when(start_virtual, until):
    """What it was told last holds, though no pose has come since."""
    robot = start_virtual("--noise", "0", "--lag-s", "0")
    line = connected(robot, until)
    bot = FishBot("F", line)
    bot.release(time.monotonic() + 2.0)
    robot.control.ask("unplug")
    assert until(lambda: not drive(bot))
    robot.control.ask("plug")
    assert until(lambda: drive(bot))
    assert until(lambda: STOP in heard(robot))
    bot.close()
