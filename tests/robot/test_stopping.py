"""A hand's STOP: `zfcal drive --stop`, on ports that are free, held, full, gone or none."""

import contextlib
import fcntl
import json
import math
import os
import pty
import resource
import subprocess
import sys
import termios
import time
import tty

import pytest

from zfcal.errors import InputError
from zfcal.robot import stopping
from zfcal.robot.aseba import Decoder
from zfcal.robot.body import Wheels
from zfcal.robot.events import motor_control, stop
from zfcal.robot.fishbot import FishBot
from zfcal.robot.port import SerialLine
from zfcal.robot.stopping import stop_at
from zfcal_cli.main import run

STOP = stop().encode()
GO = motor_control("F", 10, 12).encode()
HEAVY = ("numpy", "shapely", "serial", "pandas", "mcap", "jsonschema")


@pytest.fixture
def terminal():
    """Return the robot's end and the name of the computer's end of a raw terminal."""
    robot, computer = pty.openpty()
    tty.setraw(computer)
    yield robot, os.ttyname(computer)
    for end in (robot, computer):
        os.close(end)


def test_stop_is_sent_and_nothing_else(terminal, capsys):
    """Six bytes, with or without a trial; exit code 0."""
    robot, port = terminal
    for words in (["--port", port], ["trial", "--port", port]):
        assert run(["drive", "--stop", *words]) == 0
        assert os.read(robot, 100) == STOP
        assert f"{port}: STOP was sent." in capsys.readouterr().err


def worked_s():
    """Return the processor time of all processes that were waited for."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def test_a_hand_has_no_time(terminal):
    """A process of its own: less than a second of work, and without what takes long to load."""
    robot, port = terminal
    program = (
        "import sys; from zfcal_cli.main import run; "
        f"code = run(['drive', '--stop', '--port', {port!r}, '--json']); "
        f"sys.exit(code or bool(set(sys.modules) & set({HEAVY!r})))"
    )
    began_s = worked_s()
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, check=True)
    assert worked_s() - began_s < 1.0
    assert os.read(robot, 100) == STOP
    (result,) = json.loads(done.stdout)["results"]
    assert result == {"port": port, "sent": "STOP", "is_held_by_another": False}


def test_a_port_that_a_driver_has_is_stopped_as_well(start_virtual, until, capsys):
    """Its lock keeps other drivers out, not a hand; who has it is not disturbed, and it is said."""
    robot = start_virtual("--noise", "0", "--lag-s", "0")
    line = SerialLine(str(robot.port))
    line.beat(math.inf)
    assert until(lambda: line.is_open)
    bot = FishBot("F", line)
    assert bot.send(bot.frame_for(Wheels(left_m_s=0.2, right_m_s=0.2)))
    assert until(lambda: robot.control.ask("pose")["left_m_s"] > 0.1)
    before = termios.tcgetattr(line._serial.fileno())
    assert run(["drive", "--stop", "--port", str(robot.port)]) == 0
    assert until(lambda: robot.control.ask("pose")["left_m_s"] == 0.0)
    assert "Another process has the port" in capsys.readouterr().err
    assert termios.tcgetattr(line._serial.fileno()) == before
    assert bot.send(bot.frame_for(Wheels(left_m_s=0.2, right_m_s=0.2)))
    bot.close()


def say_nothing(_):
    """Hear that it waits."""


@contextlib.contextmanager
def nobody_in_particular(port):
    """Be a user without rights of his own, who may use the port."""
    if os.geteuid():
        yield
        return
    os.chown(port, 65534, -1)
    os.seteuid(65534)
    try:
        yield
    finally:
        os.seteuid(0)


def test_a_port_that_a_program_keeps_to_itself_is_told(terminal):
    """TIOCEXCL: one line, and it is not waited for; before and after it can be stopped."""
    robot, port = terminal
    with nobody_in_particular(port):
        stop_at(port, say_nothing)
        other = os.open(port, os.O_RDWR | os.O_NOCTTY)
        fcntl.ioctl(other, termios.TIOCEXCL)
        with pytest.raises(InputError, match=r"cannot be opened .*busy"):
            stop_at(port, say_nothing)
        fcntl.ioctl(other, termios.TIOCNXCL)
        stop_at(port, say_nothing)
        os.close(other)
    # A terminal passes on each write in its own time.
    data = os.read(robot, 100)
    while len(data) < 2 * len(STOP):
        data += os.read(robot, 100)
    assert data == 2 * STOP


def test_a_port_that_is_full_is_emptied_first(terminal):
    """Thousands of commands that nobody reads: STOP is understood behind what is left of them."""
    robot, port = terminal
    other = os.open(port, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
    with contextlib.suppress(BlockingIOError):
        while True:
            os.write(other, GO)
    stop_at(port, say_nothing)
    os.set_blocking(robot, False)
    data = bytearray()
    with contextlib.suppress(BlockingIOError):
        while True:
            data += os.read(robot, 65536)
    assert len(data) < 8000
    assert Decoder().feed(bytes(data))[-1] == stop()
    os.close(other)


@pytest.mark.parametrize(
    ("port", "says"),
    [
        ("/dev/nobody", "No such file"),
        ("/dev/null", "no serial port"),
        ("/", "cannot be opened"),
        ("bad\0name", "cannot be opened"),
    ],
)
def test_what_is_no_port_is_told_in_one_line(port, says, capsys):
    """Exit code 1."""
    assert run(["drive", "--stop", "--port", port]) == 1
    said = capsys.readouterr().err
    assert says in said
    assert "bug" not in said
    assert len(said.splitlines()) == 2


def test_a_port_that_sends_nothing_is_told_in_time(terminal, monkeypatch):
    """What was handed over and does not leave was not sent; closing does not wait for it."""
    _, port = terminal
    flushed = []
    monkeypatch.setattr(stopping, "LONGEST_S", 0.9)
    monkeypatch.setattr(stopping.Descriptor, "unsent", lambda _: 6)
    monkeypatch.setattr(stopping.Descriptor, "flush", lambda _: flushed.append(1))
    began_s = time.monotonic()
    told = []
    with pytest.raises(InputError, match=r"not sent in 0\.9 s \(it does not leave the port\)"):
        stop_at(port, told.append)
    assert time.monotonic() - began_s < 1.2
    assert flushed
    assert told == [
        f"{port}: STOP waits for the link (it does not leave the port); Ctrl-C gives up."
    ]


def test_of_a_port_that_a_driver_has_nothing_is_dropped(terminal, monkeypatch):
    """What waits there may be its own STOP."""
    _, port = terminal
    line = SerialLine(port)
    assert line.wait(5.0)
    flushed = []
    monkeypatch.setattr(stopping, "LONGEST_S", 0.1)
    monkeypatch.setattr(stopping.Descriptor, "unsent", lambda _: 6)
    monkeypatch.setattr(stopping.Descriptor, "flush", lambda _: flushed.append(1))
    with pytest.raises(InputError, match="does not leave"):
        stop_at(port, say_nothing)
    assert not flushed
    monkeypatch.undo()
    line.close()


def test_a_link_that_takes_seconds_to_come_up_is_waited_for(terminal, monkeypatch):
    """As Bluetooth does where nobody had the port: STOP waits there, is not dropped, and goes."""
    robot, port = terminal
    up_s = time.monotonic() + 1.5
    monkeypatch.setattr(
        stopping.Descriptor, "unsent", lambda _: 6 if time.monotonic() < up_s else 0
    )
    told = []
    assert stop_at(port, told.append) is False
    assert time.monotonic() >= up_s
    assert len(told) == 1
    assert os.read(robot, 100) == STOP


@pytest.mark.parametrize("lost", range(1, len(GO)))
def test_a_robot_that_does_not_obey_is_brought_back(terminal, lost):
    """It has lost bytes, and reads on from the wrong place."""
    robot, port = terminal
    assert run(["drive", "--stop", "--resync", "--port", port]) == 0
    decoder = Decoder()
    decoder.feed(GO[lost:] + GO + GO)
    time.sleep(0.02)
    assert decoder.feed(os.read(robot, 8192))[-1] == stop()
    assert decoder.feed(GO)[-1].encode() == GO


@pytest.mark.parametrize(
    "words",
    [
        ["--stop"],
        ["--stop", "--port", "virtual"],
        ["--stop", "--port", "/dev/null", "--force"],
        ["--stop", "--port", "/dev/null", "--duration", "2s"],
        ["--stop", "--port", "/dev/null", "--replay"],
        ["trial", "--resync", "--port", "/dev/null"],
        [],
        ["--replay"],
    ],
)
def test_options_that_cannot_take_effect_are_refused(words):
    """Exit code 2."""
    assert run(["drive", *words]) == 2
