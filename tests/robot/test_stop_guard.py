"""What is on the line when the robot has to stop: cut frames, kills, two writers, full lines."""

import importlib.util
import itertools
import os
import pty
import tty
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from zfcal.robot import events, stop_guard
from zfcal.robot.aseba import Decoder, Frame
from zfcal.robot.stop_guard import (
    CUT,
    DONE,
    DRIVER,
    HELPER,
    MOST_UNSENT,
    RESYNC,
    STATE,
    STOP,
    WHOLE,
    Descriptor,
    Guard,
    Output,
    Slate,
)

_spec = importlib.util.spec_from_file_location("counted", Path(__file__).with_name("counted.py"))
counted = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(counted)

KINDS = (
    events.stop(),
    events.motor_control("F", -30, 30),
    events.motor_control("A", 10, 12),
    events.fish_behavior("F", -45, 25, 14),
    events.obstacle_avoidance("F", 1),
    events.list_nodes(),
    events.get_node_description(35),
    events.get_description(),
)
GO = events.motor_control("F", 10, 12).encode()
CUTS = [(frame, cut) for frame in KINDS for cut in range(1, len(frame.encode()))]
MOVES = range(events.MOTOR_CONTROL, events.OBSTACLE_AVOIDANCE)


def test_the_last_word_is_stop():
    """Written out there, since that process imports nothing."""
    assert events.stop().encode() == STOP


@pytest.mark.parametrize("frame", KINDS, ids=lambda frame: f"{frame.type:#x}")
def test_after_resynchronisation_any_receiver_has_stopped_and_begins_a_frame(frame):
    """Cut at any byte, what was begun is ended; then STOP, no motion, and nothing is left over."""
    data = frame.encode()
    for cut in range(len(data) + 1):
        decoder = Decoder()
        decoder.feed(data[:cut])
        ended, *others = decoder.feed(RESYNC + GO)
        assert others[-2:] == [events.stop(), Frame(type=11, payload=GO[6:])]
        assert not [found for found in others[:-1] if found.type in MOVES]
        # What is left of a cut frame is filled with zeros: no wheel turns faster than was asked.
        assert ended.type <= max(frame.type, 1)


@pytest.mark.parametrize("length", range(0, 517, 3))
def test_resynchronisation_ends_the_longest_frame_that_there_is(length):
    """Whoever waits for so many bytes, be it 516, for whatever reason."""
    decoder = Decoder()
    assert decoder.feed(length.to_bytes(2, "little") + bytes(3)) == []
    assert decoder.feed(RESYNC)[-1] == events.stop()
    assert decoder.feed(GO)[0].encode() == GO


@pytest.mark.parametrize(("frame", "cut"), CUTS)
@pytest.mark.parametrize("who", [DRIVER, HELPER])
def test_a_frame_that_the_port_took_a_part_of_is_completed_by_its_own_bytes(frame, cut, who):
    """There was room for so many bytes only; then the robot understands that frame, and STOP."""
    port = counted.CountedPort(reports=False)
    slate, *outputs = counted.writers(port)
    assert outputs[DRIVER].send(GO)
    port.room = len(GO) + cut
    assert not outputs[DRIVER].send(frame.encode())
    assert slate.number(DRIVER, STATE) == CUT
    port.room = 4096
    assert outputs[who].stop()
    port.drain()
    assert port.frames()[1:3] == [frame, events.stop()]
    assert port.frames()[-1] == events.stop()


@pytest.mark.parametrize(("frame", "cut"), CUTS)
@pytest.mark.parametrize("reports", [True, False])
def test_stop_does_not_wait_behind_a_port_that_takes_no_more(frame, cut, reports):
    """What waits is dropped, wherever that cuts; counted, the cut frame is completed at once."""
    port = counted.CountedPort(room=MOST_UNSENT, reports=reports)
    _, driver, _ = counted.writers(port)
    assert driver.send(frame.encode())
    assert driver.send(GO)
    port.drain(cut)
    port.room = len(port.queue) + 3
    assert driver.stop()
    port.drain()
    if reports:
        assert port.frames()[:2] == [frame, events.stop()]
    # What it takes to be sure comes when there is room for it.
    port.room = 4096
    assert driver.stop()
    port.drain()
    assert port.frames()[-1] == events.stop()
    assert Decoder().feed(bytes(port.arrived) + GO)[-1].encode() == GO


class KilledError(Exception):
    """The process is no more."""


class Mortal:
    """Counts what a writer does to its slate and its port, and lets something happen before one."""

    def __init__(self, slate, port, *, before, happens):
        self.left, self._happens = before, happens
        self._put, self._remember, self._write = slate.put, slate.remember, port.write
        slate.put, slate.remember, port.write = self.put, self.remember, self.write

    def _act(self):
        self.left -= 1
        if self.left == 0:
            self._happens()

    def put(self, *what):
        """Set a number."""
        self._act()
        self._put(*what)

    def remember(self, *what):
        """Keep a frame."""
        self._act()
        self._remember(*what)

    def write(self, data):
        """Hand over bytes."""
        self._act()
        taken = self._write(data)
        # A kill can also come when the port has the bytes, and nobody has noted it.
        self._act()
        return taken


class PlainSlate(Slate):
    """One whose methods a test may replace."""


PORT = ("write", "unsent", "flush", "resume")


def watched(port, *, before, happens):
    """Return slate, driver and helper; before that act of the driver's, something happens."""
    slate = PlainSlate(bytearray(Slate.SIZE))
    # The other process has its own view of the same memory.
    other = Slate(slate._bytes.obj)
    helper = Output(
        type("Other", (), {name: getattr(port, name) for name in PORT})(),
        other,
        HELPER,
    )
    driver = Output(port, slate, DRIVER)
    return Mortal(slate, port, before=before, happens=lambda: happens(helper)), driver, helper


@pytest.mark.parametrize("room", [*range(len(GO), 2 * len(GO) + 1), 4096])
def test_at_whatever_instant_the_driver_is_killed_the_helpers_stop_is_understood(room):
    """Before and after each store and each write, with room for each part of the frame."""

    def kill(helper):
        raise KilledError

    for before in itertools.count(1):
        port = counted.CountedPort(room=room, reports=False)
        _, driver, helper = watched(port, before=before, happens=kill)
        try:
            driver.send(GO)
            if not driver.send(GO):
                port.room += 3
                driver.finish()
                driver.stop()
        except KilledError:
            port.room = 4096
            assert helper.stop()
            port.drain()
            assert port.frames()[-1] == events.stop()
            assert Decoder().feed(bytes(port.arrived) + GO)[-1].encode() == GO
        else:
            break
    assert before > 8


@pytest.mark.parametrize("room", [*range(len(GO), 2 * len(GO) + 1), 4096])
def test_two_writers_leave_the_line_in_step_at_whatever_instant_the_helper_writes(room):
    """The driver was stopped there, and goes on: what it sends later is understood."""
    for before in itertools.count(1):
        port = counted.CountedPort(room=room, reports=False)

        def write(helper, port=port):
            port.room = 8192
            assert helper.stop()

        mortal, driver, _ = watched(port, before=before, happens=write)
        driver.send(GO)
        if not driver.send(GO) and driver.is_cut:
            port.room += 3
            driver.finish()
            port.room = 8192
            while driver.is_cut and not driver.finish():
                pass
        port.room = 8192
        # Where the line is brought back first, that takes the place of a frame.
        assert driver.send(KINDS[3].encode()) or driver.send(KINDS[3].encode())
        assert driver.stop()
        port.drain()
        found = port.frames()
        assert KINDS[3] in found
        assert found[-1] == events.stop()
        assert Decoder().feed(bytes(port.arrived) + GO)[-1].encode() == GO
        if mortal.left > 0:
            break
    assert before > 8


@given(
    acts=st.lists(
        st.one_of(
            st.sampled_from(["stop", "helper"]),
            st.sampled_from(KINDS),
            st.integers(0, 40),
        ),
        max_size=60,
    )
)
@settings(deadline=None)
def test_no_more_than_the_bound_waits_and_the_last_stop_is_there(acts):
    """Whatever is sent and however the line goes; a STOP that is on its way is not doubled."""
    port = counted.CountedPort()
    _, driver, helper = counted.writers(port)
    for act in acts:
        if act == "stop":
            assert driver.stop()
        elif act == "helper":
            assert helper.stop()
        elif isinstance(act, int):
            port.drain(act)
        elif driver.has_room(act.encode()):
            assert driver.send(act.encode())
    assert port.most <= MOST_UNSENT
    if acts and acts[-1] in {"stop", "helper"}:
        port.drain()
        assert port.frames()[-1] == events.stop()


def test_a_port_that_tells_packets_in_place_of_bytes_is_not_taken_for_full():
    """It says 330 where ten bytes wait: what was written since nothing waited is the limit."""
    port = counted.CountedPort()
    _, driver, _ = counted.writers(port)
    port.unsent = lambda: 330 if port.queue else 0
    assert driver.send(GO)
    assert driver.waiting() == len(GO)
    assert driver.has_room(GO)
    assert driver.stop()
    assert bytes(port.queue) == GO + STOP


def test_what_another_program_left_waiting_is_dropped_at_the_beginning():
    """A thousand bytes of somebody else's commands: the robot stops instead."""
    port = counted.CountedPort()
    port.write(GO * 100)
    _, driver, _ = counted.writers(port)
    driver.begin()
    assert bytes(port.queue).startswith(STOP)
    assert GO not in bytes(port.queue)


def test_the_helper_stops_at_the_expiry_and_again_each_tick_until_it_is_fresh():
    """It wakes at that very time; a command that came late lasts a tenth of a second."""
    port = counted.CountedPort(reports=False)
    slate, driver, helper = counted.writers(port)
    guard = Guard(helper, slate)
    slate.until_s = 10.5
    assert guard.look(10.0) == stop_guard.LOOK_S
    assert guard.look(10.495) == pytest.approx(0.005)
    assert port.queue == b""
    guard.look(10.5)
    assert driver.send(GO)
    for late in range(1, 6):
        guard.look(10.5 + 0.02 * late)
    assert bytes(port.queue) == STOP + GO + STOP
    slate.until_s = 11.1
    guard.look(10.62)
    assert bytes(port.queue) == STOP + GO + STOP
    assert slate.alive_s == 10.62
    slate.until_s = float("nan")
    guard.look(10.7)
    assert bytes(port.queue).endswith(STOP + STOP)


def test_a_helper_that_hears_nothing_yet_says_stop():
    """Before the first pose nothing may move."""
    port = counted.CountedPort()
    slate, _, helper = counted.writers(port)
    guard = Guard(helper, slate)
    guard.look(1e6)
    assert port.queue == STOP
    # A robot that is led in steps has no expiry.
    slate.until_s = float("inf")
    guard.look(1e6 + 1.0)
    assert port.queue == STOP


def lossy(*, reports=True):
    """Return a port, the time, the slate and two writers of a line on which bytes may be lost."""
    port, now_s = counted.CountedPort(reports=reports), [50.0]
    slate, *outputs = counted.writers(port, is_lossless=False, clock=lambda: now_s[0])
    return port, now_s, slate, *outputs


@pytest.mark.parametrize("lost", range(len(GO) + 1))
def test_a_receiver_that_lost_a_byte_on_the_air_is_stopped_by_each_hold(lost):
    """Wherever it stands: the first STOP after a command is followed by the resynchronisation."""
    port, _, _, driver, helper = lossy()
    decoder = Decoder()
    for hold in (driver.stop, helper.stop):
        for _ in range(3):
            assert driver.send(GO)
            port.drain()
        # All but one of the bytes of a command arrive.
        data, port.arrived = bytes(port.arrived), bytearray()
        decoder.feed(data[:-lost] + data[len(data) - lost + 1 :] if lost else data)
        assert hold()
        port.drain()
        assert decoder.feed(bytes(port.arrived))[-1] == events.stop()
        port.arrived = bytearray()
        assert decoder.feed(GO)[0].encode() == GO


@pytest.mark.parametrize("who", [DRIVER, HELPER])
def test_a_hold_brings_the_receiver_back_once_a_second(who):
    """The first resynchronisation may itself have met a link that was broken."""
    port, now_s, _, *outputs = lossy()
    assert outputs[DRIVER].send(GO)
    said = []
    for _ in range(31):
        port.drain()
        port.arrived = bytearray()
        assert outputs[who].stop()
        said.append(bytes(port.queue))
        now_s[0] += 0.1
    assert set(said) == {STOP, STOP + RESYNC}
    assert said.count(STOP + RESYNC) == 4


def test_a_port_is_opened_with_stop_and_the_resynchronisation():
    """What was driven before may still move, and be in the middle of a frame."""
    port, _, slate, driver, _ = lossy()
    assert driver.begin()
    assert bytes(port.queue) == STOP + RESYNC
    assert slate.number(DRIVER, STATE) == WHOLE
    port.drain()
    assert driver.send(GO)


def test_a_driver_mends_what_the_helpers_stop_has_cut():
    """The port took a part of it: no command goes out before the receiver is at a beginning."""
    port, _, slate, driver, helper = lossy(reports=False)
    assert driver.send(GO)
    port.drain()
    port.room = 3
    flush, port.flush = port.flush, lambda: 0
    assert not helper.stop()
    port.flush, port.room = flush, 4096
    assert slate.number(HELPER, STATE) != WHOLE
    assert not driver.send(GO)
    assert driver.send(GO)
    port.drain()
    assert [frame.encode() for frame in port.frames()][-2:] == [STOP, GO]


def test_a_stop_that_waits_is_not_believed_for_ever():
    """Nothing leaves: after half a second it is dropped, and said anew."""
    port, now_s, _, _, helper = lossy()
    flushed = []
    flush = port.flush
    port.flush = lambda: flushed.append(now_s[0]) or flush()
    for _ in range(9):
        assert helper.stop()
        now_s[0] += 0.1
    assert flushed == [pytest.approx(50.6)]
    assert bytes(port.queue).startswith(STOP)


def test_an_output_that_was_held_up_is_let_go():
    """Its holder was killed in the middle of a flush: STOP would never leave."""
    port, _, slate, driver, helper = lossy()
    assert driver.send(GO)
    resumed = []
    port.resume = lambda: resumed.append(1)
    slate.put(DRIVER, STATE, stop_guard.UNKNOWN)
    assert helper.stop()
    assert resumed


def test_an_unfinished_resynchronisation_is_not_taken_for_a_whole_frame():
    """The port took a part of it: the next command brings the receiver back first."""
    port, _, slate, driver, _ = lossy()
    assert driver.send(GO)
    port.room = 200
    assert driver.stop()
    assert slate.number(DRIVER, STATE) == stop_guard.UNKNOWN
    port.drain()
    port.room = 4096
    assert not driver.finish()
    port.drain()
    assert driver.send(GO)
    port.drain()
    assert Decoder().feed(bytes(port.arrived))[-1].encode() == GO


def test_a_terminal_that_nobody_reads_takes_stop_when_it_is_full():
    """A real one, with 16 kB of commands in it: read at last, they end in STOP, in step."""
    robot, computer = pty.openpty()
    tty.setraw(computer)
    for end in (robot, computer):
        os.set_blocking(end, False)
    slate = Slate(bytearray(Slate.SIZE))
    driver, helper = (Output(Descriptor(computer), slate, who) for who in (DRIVER, HELPER))
    sent = 0
    while driver.send(GO):
        sent += len(GO)
    sent += slate.number(DRIVER, DONE)
    assert sent > 16_000
    assert helper.stop()
    data = bytearray()
    while part := read_some(robot):
        data += part
    assert Decoder().feed(bytes(data))[-1] == events.stop()
    assert Decoder().feed(bytes(data) + GO)[-1].encode() == GO
    for end in (robot, computer):
        os.close(end)


def read_some(descriptor):
    """Return what is there; nothing where nothing is."""
    try:
        return os.read(descriptor, 65536)
    except BlockingIOError:
        return b""


def test_a_slate_is_one_memory_for_both():
    """What one writes the other reads, through the descriptor that a process is given."""
    import mmap

    slate = Slate.shared()
    other = Slate(mmap.mmap(slate.descriptor, Slate.SIZE))
    slate.until_s = 12.25
    slate.remember(GO, 4)
    slate.put(DRIVER, STATE, WHOLE)
    assert (other.until_s, other.frame(0), other.number(DRIVER, DONE)) == (12.25, GO, 4)
    assert other.missing(0) == GO[4:]
    assert other.missing(3) == GO[1:]
    assert other.missing(4) == b""
