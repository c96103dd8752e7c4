"""The robot stops, whatever happens in whatever order: driver, helper, line and robot in made time.

The pilot, the driver, its watchdog, the helper's logic, both writers and the simulated robot are
the real ones; processes, threads and the serial port are played by one loop of 5 ms. What
happens to real processes is in ``tests/drive/test_drive_stops_really.py``.
"""

import dataclasses
import importlib.util
import math
from collections import Counter
from pathlib import Path

import pytest
from hypothesis import HealthCheck, Phase, settings
from hypothesis import strategies as st
from hypothesis.stateful import (
    RuleBasedStateMachine,
    initialize,
    invariant,
    precondition,
    rule,
    run_state_machine_as_test,
)

from zfcal.artifacts.models import read_model
from zfcal.drive.clock import WallClock
from zfcal.drive.driving import Crew, Driver
from zfcal.drive.pilot import InForce, Manner
from zfcal.model.packing import pack
from zfcal.parameters import from_genes, to_genes
from zfcal.robot import events
from zfcal.robot.body import WHEEL_LIMIT_M_S, Pose
from zfcal.robot.confines import Confines
from zfcal.robot.fishbot import FishBot, Watchdog
from zfcal.robot.motion import Goal
from zfcal.robot.plausible import is_frame
from zfcal.robot.simulated import SimulatedFishBot, Traits
from zfcal.robot.stop_guard import (
    DRIVER,
    HELPER,
    RESYNC,
    STATE,
    STOP,
    WHOLE,
    Guard,
    Output,
    Slate,
)
from zfcal.stages.trial_context import open_trial
from zfcal.tracks import FISH, ROBOT, AgentPose, FramePoses


def _load(folder, name):
    spec = importlib.util.spec_from_file_location(name, Path(__file__).parents[1] / folder)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


driven = _load("drive/driven.py", "driven")
counted = _load("robot/counted.py", "counted")

STEP_S = 0.005
BYTES_A_STEP = 58
"""What a line of 115200 baud sends in 5 ms."""

PATIENCE_S, TICK_S = 0.5, 0.1
SLACK_S = 3 * STEP_S
"""A step each for the writer, the line and the robot."""

RESYNC_S = len(RESYNC) / BYTES_A_STEP * STEP_S
"""Until a receiver that had lost its place has found it again."""

BRAKING_S = 0.3
"""From 0.3 m/s to 0 at 1 m/s^2."""

FPS = 15
WRONG = {
    "outside": {"x_m": 9.0},
    "unsure": {"confidence": 0.2},
    "nan": {"x_m": math.nan},
    "infinite": {"y_m": math.inf},
    "huge": {"x_m": 1e308, "y_m": -1e308},
}
GOALS = [math.nan, math.inf, -math.inf, 1e308]
PLACES: dict = {}
COUNTED: Counter = Counter()


@pytest.fixture(scope="module", autouse=True)
def trial(tmp_path_factory):
    """Make the trial that all examples drive, and two models for it."""
    root = driven.make_trial(tmp_path_factory.mktemp("stops") / "trial")
    opened = open_trial(root)
    model = read_model(root / "models" / "000000.toml")
    genes = to_genes(model)
    models = [model, from_genes(genes * 0.9, model)]
    PLACES["opened"] = opened
    PLACES["models"] = [
        InForce(
            name=f"models/{k:06d}.toml",
            sha256="0" * 64,
            text="",
            parameters=each,
            packed=pack([each], opened.arena),
        )
        for k, each in enumerate(models)
    ]


class Models:
    """Hands out models when the test says so."""

    problem = ""

    def __init__(self):
        self.next = None

    def first(self):
        """Return the first model."""
        return PLACES["models"][0]

    def look(self, _):
        """Return a new model, if there is one."""
        found, self.next = self.next, None
        return found


class Ledger:
    """A log that remembers how the robot was held."""

    n_ticks_skipped = n_steps_missed = 0

    def add(self, item):
        """Count commands by why they were held."""
        if item["what"] == "command":
            COUNTED[f"held {item['held']}"] += 1

    def measure(self, what, seconds):
        """Measure nothing: time is made."""


class Line:
    """The line as `SerialLine` keeps it, in made time."""

    def __init__(self, world):
        self._world = world
        self.n_opened, self.until_s = 0, 0.0
        self.open()

    def open(self):
        """Open the port anew, with a helper."""
        world = self._world
        world.slate = Slate(bytearray(Slate.SIZE))
        world.slate.until_s = self.until_s
        self.output = Output(world.port, world.slate, DRIVER, clock=lambda: world.now_s)
        assert self.output.begin()
        self.is_open = True
        self.n_opened += 1
        world.start_helper()

    @property
    def is_guarded(self):
        """Whether the helper is at work."""
        world = self._world
        return world.helper is not None and world.now_s - world.slate.alive_s < PATIENCE_S

    def write(self, data):
        """Send a frame."""
        if not self.is_open:
            return False
        if data == STOP:
            return self.output.stop()
        return self.output.has_room(data) and self.output.send(data)

    def read(self):
        """Return what the robot has said."""
        said = self._world.robot.take_output()
        return said if self.is_open else b""

    def beat(self, until_s):
        """Tell the helper."""
        self.until_s = self._world.slate.until_s = until_s


class World:
    """All of it, and the time."""

    def __init__(self, free_running, pattern):
        opened = PLACES["opened"]
        self.now_s = 100.0
        confines = Confines(opened.arena.outline, 0.015)
        x, y = confines.inner.representative_point().coords[0]
        start = Pose(x_m=x, y_m=y, heading_rad=0.0)
        self.robot = SimulatedFishBot(Traits(noise=0.0, lag_s=0.0), start, confines=confines)
        self.manner = Manner(free_running=free_running, pattern=pattern)
        self.models = Models()
        self.port = counted.CountedPort()
        self.heard, self.hears = [], True
        self.helper = self.slate = None
        self.helper_runs, self.helper_due_s, self.helper_wakes_s = True, math.inf, 0.0
        self.driver_runs, self.hangs_until_s = True, 0.0
        self.sees, self.wrong = True, None
        self.written_s, self.fresh_s = -math.inf, -math.inf
        self.late_until_s, self.deaf_until_s = 0.0, 0.0
        self.frame, self.pending, self.anchors = 0, [], []
        self.behind_s, self.on_its_way, self.newest_s = 0.0, [], -math.inf
        self.loses, self.is_astray, self.since_lost = 0, False, bytearray()
        self.number = 0
        self.start_driver()

    def start_driver(self):
        """Start a driver that has the port for itself."""
        self.line = Line(self)
        self.bot = FishBot("F", self.line, clock=lambda: self.now_s)
        self.watchdog = Watchdog(self.bot, clock=lambda: self.now_s)
        crew = Crew(
            robot=self.bot,
            clock=WallClock(lambda: self.now_s),
            models=self.models,
            log=Ledger(),
            tell=lambda _: None,
            watchdog=self.watchdog,
        )
        self.driver = Driver(PLACES["opened"], self.manner, crew)
        self.looked_s = self.now_s
        self.all_late_s = math.inf
        self.driver_runs, self.hangs_until_s = True, 0.0

    def start_helper(self):
        """Start a helper on the slate that there is."""
        output = Output(self.port, self.slate, HELPER, clock=lambda: self.now_s)
        self.helper = Guard(output, self.slate)
        self.slate.alive_s = self.now_s
        self.helper_runs, self.helper_wakes_s, self.helper_due_s = True, self.now_s, math.inf

    def pass_s(self, seconds):
        """Let time pass."""
        for _ in range(max(1, round(seconds / STEP_S))):
            self.step()

    def step(self):
        """Do all that happens in 5 ms."""
        self.now_s += STEP_S
        self.track()
        self.replace_helper()
        if self.driver_runs:
            self.drive()
        if self.helper is not None and self.helper_runs and self.now_s >= self.helper_wakes_s:
            self.helper_wakes_s = self.now_s + self.helper.look(self.now_s)
        if self.hears:
            self.port.drain(BYTES_A_STEP)
            arrived = self.on_the_air(self.port.arrived)
            self.port.arrived = bytearray()
            self.heard += [(self.now_s, frame) for frame in self.robot.receive(arrived)]
        self.robot.advance(self.now_s - 100.0)
        self.check()

    def on_the_air(self, data):
        """Return what arrives: all, or all but a byte."""
        if self.loses and data:
            at = min(self.loses, len(data)) - 1
            data = data[:at] + data[at + 1 :]
            self.loses, self.is_astray = 0, True
            self.since_lost = bytearray()
        if self.is_astray:
            # Until the receiver was brought to the beginning of a frame.
            self.since_lost += data
            self.is_astray = RESYNC not in self.since_lost
        return bytes(data)

    def track(self):
        """Write the frames of poses that the tracker is done with."""
        self.look()
        while self.on_its_way and self.on_its_way[0][0] <= self.now_s - self.behind_s:
            taken_s, is_fresh, poses = self.on_its_way.pop(0)
            self.newest_s = taken_s
            if is_fresh:
                # Fresh for whoever takes it; a driver that is stopped knows nothing of it.
                self.written_s = taken_s
            self.pending.append(poses)

    def look(self):
        """Take an image, when one is due."""
        frame = int((self.now_s - 100.0) * FPS)
        if frame == self.frame or not self.sees:
            return
        self.frame = frame
        at = self.robot.pose
        robot = {"x_m": at.x_m, "y_m": at.y_m, "heading_rad": at.heading_rad, "confidence": 1.0}
        fish = {"x_m": at.x_m + 0.05, "y_m": at.y_m, "heading_rad": 1.0, "confidence": 1.0}
        agents = [AgentPose(agent=0, kind=FISH, **fish)]
        if self.wrong == "jumping":
            robot["y_m"] += (0.3, -0.3, 0.5)[frame % 3]
        elif self.wrong in WRONG:
            robot |= WRONG[self.wrong]
        if self.wrong != "lost":
            agents.append(AgentPose(agent=4, kind=ROBOT, **robot))
        is_fresh = self.wrong is None or (self.wrong == "jumping" and self.is_in_reach(robot))
        if is_fresh:
            self.anchors.append((self.now_s, robot["x_m"], robot["y_m"]))
            del self.anchors[:-300]
        poses = FramePoses(time_s=frame / FPS, frame=frame + self.number, agents=tuple(agents))
        self.number = 0
        self.on_its_way.append((self.now_s, is_fresh, poses))

    def is_in_reach(self, robot):
        """Return whether the robot can have driven there from a place where it was seen."""
        return any(
            math.dist((x, y), (robot["x_m"], robot["y_m"])) <= 0.3 * (self.now_s - t + 0.07) + 0.031
            for t, x, y in self.anchors
        )

    def drive(self):
        """Do what the driver's two threads do."""
        if round(self.now_s / STEP_S) % 8 == 0:
            self.watchdog.look()
        if self.now_s < self.hangs_until_s:
            return
        frames, self.pending = self.pending, []
        # By how much all frames are late that a driver has seen, it cannot know; nor whether they
        # are, or the camera is up to 1 % slow.
        self.all_late_s += 0.01 * (self.now_s - self.looked_s)
        if frames:
            self.all_late_s = min(self.all_late_s, self.now_s - self.newest_s)
        if self.all_late_s < math.inf:
            # What it took for fresh before it learnt how late frames were stays so.
            self.fresh_s = max(self.fresh_s, self.written_s + self.all_late_s)
        frames = [each for each in frames if is_frame(each.time_s, each.frame, FPS)]
        since_s, self.looked_s = self.looked_s, self.now_s
        self.driver.listen()
        self.driver.take(frames, age_s=STEP_S if frames else None, since_s=since_s)
        self.driver.tick()

    def replace_helper(self):
        """Do what the line's thread does about a helper that is lost."""
        if not (self.driver_runs and self.line.is_open) or self.line.is_guarded:
            return
        if math.isinf(self.helper_due_s):
            self.helper = None
            self.line.output.is_lost = self.slate.number(HELPER, STATE) != WHOLE
            assert self.line.output.stop()
            self.slate.put(HELPER, STATE, WHOLE)
            self.helper_due_s = self.now_s + 0.1
        elif self.now_s >= self.helper_due_s:
            self.start_helper()

    @property
    def is_stoppable(self):
        """Whether the line is there, and has been for a tick."""
        return self.hears and self.now_s > self.deaf_until_s + TICK_S + SLACK_S

    def check(self):
        """Check what always holds."""
        asked, real = self.robot._asked, self.robot.wheels
        for wheels in (asked, real):
            assert max(abs(wheels.left_m_s), abs(wheels.right_m_s)) <= WHEEL_LIMIT_M_S + 1e-9
        if not self.is_astray:
            for _, frame in self.heard[-8:]:
                if frame.type == events.MOTOR_CONTROL + 5:
                    assert max(map(abs, frame.arguments)) <= 30
        old_s = self.now_s - self.fresh_s
        if not self.is_stoppable or self.now_s <= self.late_until_s + SLACK_S:
            return
        if self.is_astray:
            # The receiver has lost its place: what brings it back, takes its time.
            old_s -= RESYNC_S
        if old_s > PATIENCE_S + TICK_S + SLACK_S:
            assert (asked.left_m_s, asked.right_m_s) == (0.0, 0.0), f"{old_s:.3f} s old"
            # The last that was heard: STOP came in time, and nothing after it.
            assert not self.heard or self.heard[-1][1].type not in {11, 21}
            COUNTED["checked while stale"] += 1
        since_s = max(self.fresh_s, self.late_until_s, self.deaf_until_s)
        if self.is_astray:
            since_s += RESYNC_S
        if self.now_s - since_s > PATIENCE_S + TICK_S + SLACK_S + BRAKING_S:
            assert (real.left_m_s, real.right_m_s) == (0.0, 0.0)


class Stops(RuleBasedStateMachine):
    """Everything that can happen, in any order; both processes frozen at once is left out."""

    @initialize(free_running=st.booleans(), pattern=st.sampled_from(["fish", "pid"]))
    def begin(self, free_running, pattern):
        """Start, and drive."""
        self.world = World(free_running, pattern)
        self.world.pass_s(0.5)

    @invariant()
    def counts(self):
        """Count the steps."""
        COUNTED["steps"] += 1

    @rule(seconds=st.sampled_from([0.03, 0.1, 0.25, 0.55, 0.8]))
    def wait(self, seconds):
        """Time passes."""
        self.world.pass_s(seconds)

    @rule(seconds=st.sampled_from([0.1, 0.4, 0.7]))
    def poses_end(self, seconds):
        """No frame comes any more."""
        self.world.sees = False
        self.world.pass_s(seconds)

    @rule(wrong=st.sampled_from(["lost", "jumping", *WRONG]), seconds=st.sampled_from([0.1, 0.7]))
    def robot_is_not_seen(self, wrong, seconds):
        """Frames come, without a pose of the robot that is one."""
        self.world.wrong = wrong
        self.world.sees = True
        self.world.pass_s(seconds)

    @rule()
    def poses_are_well(self):
        """Frames come again, and the robot is in them."""
        self.world.sees, self.world.wrong = True, None
        self.world.pass_s(0.1)

    @rule(y=st.sampled_from([-0.4, 0.1, 0.5]))
    def lift(self, y):
        """Somebody puts the robot elsewhere."""
        at = self.world.robot.pose
        confines = self.world.robot._confines
        x_m, y_m, _ = confines.clamp(at.x_m, at.y_m + y)
        self.world.robot.place(Pose(x_m=x_m, y_m=y_m, heading_rad=at.heading_rad))
        self.world.pass_s(0.1)

    @rule(k=st.sampled_from([0, 1]))
    def new_parameters(self, k):
        """Another model drives."""
        self.world.models.next = PLACES["models"][k]
        self.world.pass_s(0.2)

    @rule(where=st.sampled_from(["x_m", "y_m", "speed_m_s"]), value=st.sampled_from(GOALS))
    def bad_target(self, where, value):
        """A target that is no place."""
        pilot = self.world.driver.pilot
        if pilot._target is not None:
            goal = {"x_m": 0.1, "y_m": 0.1, "speed_m_s": 0.1} | {where: value}
            pilot._target = dataclasses.replace(pilot._target, goal=Goal(**goal))
        self.world.pass_s(0.15)

    @rule(seconds=st.sampled_from([0.3, 0.8, 2.0]))
    def tracker_falls_behind(self, seconds):
        """From now on it writes poses of images that old."""
        self.world.behind_s = seconds
        self.world.pass_s(seconds)

    @rule()
    def tracker_catches_up(self):
        """It writes all of them at once."""
        self.world.behind_s = 0.0
        self.world.pass_s(0.1)

    @rule(number=st.sampled_from([-(10**6), -100, 12, 10**9]))
    def absurd_number(self, number):
        """A frame has a number that is not of its time."""
        self.world.number = number
        self.world.pass_s(0.2)

    @precondition(lambda self: self.world.hears)
    @rule(at=st.integers(1, 12))
    def byte_is_lost(self, at):
        """On the air: a receiver that has no way to know reads on from the wrong place."""
        self.world.loses = at
        self.world.pass_s(0.2)

    @rule()
    def obstacle(self):
        """The robot meets something."""
        self.world.robot.meet_obstacle()
        self.world.pass_s(0.1)

    @rule(seconds=st.sampled_from([0.5, 4.0]))
    def power_down(self, seconds):
        """The robot loses its supply for a while."""
        self.world.robot.starve(seconds)
        self.world.pass_s(0.3)

    @precondition(lambda self: self.world.hears and self.world.driver_runs)
    @rule()
    def port_is_lost(self):
        """Nothing that is sent arrives, and what waited is gone with it."""
        world = self.world
        world.hears = world.line.is_open = False
        world.helper = None
        world.port.queue.clear()
        # Its receiver waits for the rest of whatever frame that has cut.
        world.is_astray, world.since_lost = True, bytearray()
        world.pass_s(0.2)

    @precondition(lambda self: not self.world.hears and self.world.driver_runs)
    @rule()
    def port_is_back(self):
        """The line's thread opens it again."""
        world = self.world
        world.hears, world.deaf_until_s = True, world.now_s
        world.line.open()
        # Its receiver, which waits for the rest of a frame, is brought back before anything else.
        world.pass_s(0.1 + RESYNC_S)
        assert not world.is_astray

    @precondition(lambda self: self.is_whole)
    @rule(seconds=st.sampled_from([0.05, 0.7, 0.9]), late=st.booleans())
    def driver_is_stopped(self, seconds, late):
        """Ctrl-Z or SIGSTOP for a while; maybe between a look at the clock and a write."""
        world = self.world
        # It must have found something fresh, or it would not be about to write.
        late = late and not world.bot.is_held and not world.bot._is_late()
        world.driver_runs = False
        world.pass_s(seconds)
        world.driver_runs = True
        if late and world.line.output.has_room(GO):
            world.line.output.send(GO)
            world.late_until_s = world.now_s + TICK_S + SLACK_S
        world.pass_s(0.1)

    @precondition(lambda self: self.world.driver_runs)
    @rule(seconds=st.sampled_from([0.2, 0.6, 1.2]))
    def driver_hangs(self, seconds):
        """Its main thread waits for something; its watchdog is awake."""
        self.world.hangs_until_s = self.world.now_s + seconds
        self.world.pass_s(seconds)

    @precondition(lambda self: self.is_whole)
    @rule(softly=st.booleans(), seconds=st.sampled_from([0.1, 0.7]))
    def driver_ends(self, softly, seconds):
        """By SIGTERM or SIGKILL; after a while somebody starts another one."""
        world = self.world
        if softly:
            assert world.bot.hold()
        world.driver_runs = False
        assert world.helper.begin_last()
        world.helper = None
        ended_s = world.now_s
        world.pass_s(seconds + RESYNC_S)
        # Nothing but the driver's end is needed for that: poses may still come.
        assert any(f.type == events.STOP for t, f in world.heard if t >= ended_s)
        asked = world.robot._asked
        assert (asked.left_m_s, asked.right_m_s) == (0.0, 0.0)
        world.pending = []
        world.start_driver()
        world.pass_s(0.1)

    @precondition(lambda self: self.is_whole)
    @rule(writing=st.booleans())
    def helper_is_killed(self, writing):
        """Maybe between a write and its note of it."""
        world = self.world
        if writing:
            world.slate.put(HELPER, STATE, 1)
        world.helper = None
        killed_s, asked = world.now_s, world.robot._asked
        # Of all, one that stands and has lost a byte is brought back within a second, not at once.
        moves = (asked.left_m_s, asked.right_m_s) != (0.0, 0.0)
        hears_at_once = moves or not (world.is_astray or world.loses)
        world.pass_s(0.12 + RESYNC_S)
        if world.hears and hears_at_once:
            assert any(f.type == events.STOP for t, f in world.heard if t >= killed_s)

    @precondition(lambda self: self.is_whole)
    @rule(seconds=st.sampled_from([0.1, 0.8]))
    def helper_is_stopped(self, seconds):
        """By SIGSTOP; it is replaced, or goes on."""
        world = self.world
        world.helper_runs = False
        world.pass_s(seconds)
        world.helper_runs = True

    @precondition(lambda self: self.world.driver_runs and self.world.hears)
    @rule()
    def all_is_well(self):
        """Then the robot is driven again before long: who stops for ever is safe and useless."""
        world = self.world
        if world.is_astray:
            # Whoever drives does not know: the next hold brings the receiver back.
            world.sees, world.behind_s = False, 0.0
            world.pass_s(1.0)
            assert not world.is_astray
        world.sees, world.wrong, world.behind_s = True, None, 0.0
        world.robot._starving_until_s = -math.inf
        world.pass_s(2.0)
        moves = [t for t, f in world.heard if f.type == events.MOTOR_CONTROL + 5]
        assert moves
        assert world.now_s - moves[-1] < 0.3
        COUNTED["driven on"] += 1
        del world.heard[:-20]

    @property
    def is_whole(self):
        """Whether driver and helper are at work on a port that is there."""
        world = self.world
        return world.driver_runs and world.helper_runs and world.hears and world.line.is_guarded

    def teardown(self):
        """Close it all: STOP is the last that is heard."""
        world = getattr(self, "world", None)
        if world is not None and world.hears and world.driver_runs:
            world.bot.hold()
            world.driver_runs = False
            world.pass_s(0.1 + RESYNC_S)
            known = [f.type for _, f in world.heard if f.type in {events.STOP, 11, 21}]
            assert known[-1] == events.STOP


GO = events.motor_control("F", 12, 10).encode()
HOW = {
    "phases": (Phase.generate,),
    "deadline": None,
    "derandomize": True,
    "database": None,
    "suppress_health_check": list(HealthCheck),
}


def test_a_driver_that_is_stopped_while_it_takes_a_pose_knows_that_it_is_old():
    """By SIGSTOP in the middle of a step: the pose is as old as the look that did not find it."""
    world = World(free_running=False, pattern="fish")
    world.pass_s(0.5)
    see = world.driver.pilot.see

    def stopped(*asked):
        found = see(*asked)
        world.now_s += 1.0
        return found

    world.driver.pilot.see = stopped
    before_s, seen_s = world.now_s, world.driver._seen_s
    frame = int((world.now_s - 100.0) * FPS) + 1
    at = world.robot.pose
    own = AgentPose(
        agent=4, kind=ROBOT, x_m=at.x_m, y_m=at.y_m, heading_rad=at.heading_rad, confidence=1.0
    )
    poses = FramePoses(time_s=frame / FPS, frame=frame, agents=(own,))
    world.driver.take([poses], age_s=STEP_S, since_s=before_s)
    assert world.driver.pilot.pose is not None
    assert world.driver._seen_s == seen_s
    assert world.bot._until_s <= before_s + PATIENCE_S


@pytest.mark.slow
def test_the_robot_stops_whatever_happens():
    """Some hundred steps; `make test-slow` does more than ten thousand."""
    COUNTED.clear()
    run_state_machine_as_test(
        Stops, settings=settings(max_examples=30, stateful_step_count=25, **HOW)
    )
    assert COUNTED["steps"] > 200
    assert COUNTED["checked while stale"] > 500


@pytest.mark.slow
def test_the_robot_stops_whatever_happens_in_ten_thousand_steps():
    """And each way to be held was met, and each time it was driven on when all was well."""
    COUNTED.clear()
    run_state_machine_as_test(
        Stops, settings=settings(max_examples=290, stateful_step_count=50, **HOW)
    )
    assert COUNTED["steps"] >= 10_000
    assert COUNTED["driven on"] > 100
    held = {"stale-pose", "helper-lost", "port-lost", "power-down", "obstacle", "refused", ""}
    assert {name for name in held if COUNTED[f"held {name}"]} == held
