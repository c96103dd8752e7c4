"""What the loops work on: parameters, what is hidden, and a run; and their constants."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

DT_S = 0.2
N_CELLS = 180
"""Headings are drawn from cells of two degrees, uniform within a cell."""
CELL_RAD = 2 * math.pi / N_CELLS
ANGLE = -math.pi + (np.arange(N_CELLS) + 0.5) * CELL_RAD
COS, SIN = np.cos(ANGLE), np.sin(ANGLE)
SHORT_M = 0.002
"""A displacement that is shorter has no heading on a recording."""

# One column of a plan's strengths per form of an effect. Nameless ones are free: a form keeps
# its number, by which its constants are drawn.
(
    ALIGNMENT, WALL_PERSISTENCE, GROUP_COHESION, INTERACTION_RANGE, REAR_BLIND_ZONE,
    LEADER_FOLLOWING, REACTION_DELAY, COLLECTIVE_DEPARTURE, PLACE_PREFERENCE, DIRECTIONAL_DRIFT,
    TURNING_BIAS, TURNING_MEMORY, SPEED_MATCHING, CROWDING, BURST_AND_COAST, SPEED_TURN_COUPLING,
    FREEZING, FATIGUE, HABITUATION, BOLDNESS, ROBOT_AVOIDANCE,
    WAXING_WALLS, STARTLE, SOUND, KEPT_DISTANCE, ONE_EYE, LIT_ROOM,
    FLOW, NEAREST_HEADING, RECENT_SENSE, _, CENTROID, REGAIN, RANGE_DECAY, _,
    REAR_CARDIOID, _, _, ONE_LEADER, SNAPSHOT, _, _, QUORUM, HOME, _,
    _, BEND, SIDES, _, LEAKY_TURN, ALTERNATION, COMPANYS_PACE, NEARESTS_PACE,
    NEAR_ANOTHER, JOSTLE, GLIDE, RHYTHM, _, AFTER_TURN, SHY_FREEZE, CRAWL,
    SUDDEN_FATIGUE, UNEVEN_FATIGUE, SUDDEN_HABITUATION, _, _, BOLD_CENTRE,
    FLEE_ROBOT, _, N_EFFECTS,
) = range(70)  # fmt: skip
N_CONSTANTS = 2
"""At most so many constants of a form are drawn by the seed."""

FREEZE_S = 2.0
FROZEN_M_S = 0.002
BLIND_RAD = math.radians(95)
FELT_M = 0.05
LATE_STEPS = 3
CRAWL_M_S = 0.015
TRIAL_S = 1800.0
STARTLE_STEPS = 3
STARTLE_REST_STEPS = 15
DEPARTURE_STEPS = 15


class Law(NamedTuple):
    """Parameters by zone id, row 0 unused; ``speed`` holds shares of bins of 0.02 m/s."""

    kappa_0: Floats
    kappa_f: Floats
    alpha: Floats
    gamma: Floats
    speed: Floats
    scale_0: Floats
    scale_f: Floats
    fov_rad: float


class Plan(NamedTuple):
    """What is hidden: strengths (agent, form), and where and who it touches.

    ``constants`` (form, `N_CONSTANTS`) are those that the seed has drawn; ``further`` is 1
    where the plan holds a further form, so that other plans need not look for one.
    """

    strength: Floats
    place: Floats
    speaker: Floats
    compass_rad: float
    phase_rad: float
    bold: Floats
    robot: int
    constants: Floats
    further: int


class Past(NamedTuple):
    """A run: states at 0 ... T, steps 0 ... T - 1, and the log densities of its steps.

    ``xy`` (T + 1, agent, 2), ``heading`` and ``zone`` (T + 1, agent); ``turn``,
    ``speed``, ``score`` (speed's normal score), ``frozen`` and ``startled`` (T, agent);
    ``log_heading`` and ``log_speed`` (T, agent); ``left`` (room, agent), step at which
    an agent last left a room.
    """

    xy: Floats
    heading: Floats
    zone: Ints
    turn: Floats
    speed: Floats
    score: Floats
    frozen: Ints
    startled: Ints
    log_heading: Floats
    log_speed: Floats
    left: Ints
    first: int
