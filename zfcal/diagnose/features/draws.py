"""What fish saw, and where the base law drew them, of one draw of where all were."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache, partial
from typing import final

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri
from scipy.stats.qmc import LatinHypercube

from zfcal.arrays import Floats
from zfcal.model.directions import turned_by
from zfcal.model.extended import without_effects
from zfcal.model.features import AWAY_M, Seen
from zfcal.model.histories import (
    ago_heading,
    courses,
    in_open,
    lately,
    mean_speed,
    recent_turn,
    stayed,
    straight,
)
from zfcal.model.kernels.perception import REPULSION_M
from zfcal.model.kernels.scene import fill_states, head_late, perceive
from zfcal.model.kernels.state import (
    HX,
    HY,
    KIND,
    LATELY,
    LEFT_AT_S,
    LEFT_FROM,
    LEFT_S,
    MOUTH_X,
    MOUTH_Y,
    PAST_HX,
    PAST_HY,
    ROOM,
    SPEED,
    TAU_X,
    TAU_Y,
    TIME,
    ZONE,
    X,
    Y,
)
from zfcal.model.packing import pack
from zfcal.model.scene import Scene, Turns
from zfcal.model.tank import tank_of
from zfcal.model.views import View, view_of
from zfcal.parameters import Parameters
from zfcal.units import HEADING_MIN_STEP_M


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Steps:
    """The steps of a law, and what of it bears on what is seen.

    Parameters
    ----------
    scene
        The recording.
    parameters
        The model, effects and all.
    rows : ndarray of int, shape (step,)
        Places of the steps among the scene's turns.
    turns
        These turns.
    follows : ndarray of bool, shape (step,)
        Whether a step begins in a zone that follows walls.
    alpha : ndarray, shape (step,)
        Weight of neighbours per steradian.
    """

    scene: Scene
    parameters: Parameters
    rows: NDArray[np.intp]
    turns: Turns
    follows: NDArray[np.bool_]
    alpha: Floats


@final
class Sight:
    """What was seen, worked out by whoever asks first; what it was made from is let go then."""

    def __init__(self, make: Callable[[], Seen]) -> None:
        self._make: Callable[[], Seen] | None = make
        self._made: list[Seen] = []
        self._lock = threading.Lock()

    @property
    def seen(self) -> Seen:
        """By the fish of some steps."""
        with self._lock:
            if self._make is not None:
                self._made.append(self._make())
                self._make = None
            return self._made[0]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Draw:
    """What the fish saw, and the directions of the base law, of one draw of where all were.

    Parameters
    ----------
    sight
        Works out what was seen when that is asked for: the law alone needs nothing of it.
    base : ndarray, shape (step, mode, 2)
        Directions of the base law; the second is zero where there is one.
    toward, angle_sr : ndarray, shape (step, source, 2) and (step, source)
        As the model draws to others, effects on sight and all.
    whole_rad : ndarray, shape (step,)
        Angle by which its effects turn all directions; empty for none.
    """

    sight: Sight
    base: Floats
    toward: Floats
    angle_sr: Floats
    whole_rad: Floats

    @property
    def seen(self) -> Seen:
        """By the fish of the steps; directions turned so that the heading taken is as measured."""
        return self.sight.seen

    def as_drawn(self, ways: Floats) -> Floats:
        """Return where a component is drawn to that is about some directions that were seen.

        Parameters
        ----------
        ways : ndarray, shape (step, source, 2)
        """
        return turned_by(ways, self.whole_rad[:, None]) if len(self.whole_rad) else ways


def errors_of(n: int, scene: Scene, random: np.random.Generator) -> Floats:
    """Return errors of all positions, standard normal, shape (draw, sample, agent, 2).

    Each coordinate has every part of the normal law once, in an order of its own: a Latin hypercube
    (McKay, Beckman and Conover 1979, Technometrics 21: 239-245). Averages over so few draws then
    err by much less than those of independent ones.

    Parameters
    ----------
    n
        Draws.
    scene
        The recording.
    random
        Source of the orders.
    """
    samples, _, agents = scene.states.shape
    latin = LatinHypercube(samples * agents * 2, rng=random)
    return np.asarray(ndtri(latin.random(n))).reshape(n, samples, agents, 2)


def drawn(steps: Steps, errors_m: Floats) -> Draw:
    """Return a draw of where all may have been, by the error of the measured positions.

    Parameters
    ----------
    steps
        Of the law.
    errors_m : ndarray, shape (sample, agent, 2)
        Of the positions.
    """
    states, arena = steps.scene.states, steps.scene.arena
    xy = np.moveaxis(states[:, [X, Y]], 1, 2).copy()
    xy[~(states[:, ZONE] > 0)] = np.nan
    moved, _ = arena.settle(xy + errors_m)
    clock = (float(states[0, TIME, 0]), steps.scene.dt_s)
    made = fill_states(
        np.ascontiguousarray(moved), states[0, KIND].copy(), clock, HEADING_MIN_STEP_M / 4,
        tank_of(arena),
    )  # fmt: skip
    # Speeds decide who is fast, and are not what is in doubt.
    kept = [SPEED, LATELY, ROOM, LEFT_S, LEFT_AT_S, LEFT_FROM]
    made[:, kept] = states[:, kept]
    return draw_of(steps, made, view_of(replace(steps.scene, states=made), steps.parameters))


def draw_of(steps: Steps, states: Floats, view: View) -> Draw:
    """Return a draw from the states of everybody.

    Parameters
    ----------
    steps
        Of the law.
    states : ndarray, shape (sample, state, agent)
        The scene's own, or others in which all are somewhere near.
    view
        What the model makes of these.
    """
    turns, scene = steps.turns, steps.scene
    at, who = turns.at, turns.who
    own, after = states[at, :, who], states[at + 1, :, who]
    back = np.zeros(len(at))
    heading = turns.heading
    if states is not scene.states:
        step = after[:, [X, Y]] - own[:, [X, Y]]
        back = np.arctan2(turns.taken[:, 1], turns.taken[:, 0]) - np.arctan2(step[:, 1], step[:, 0])
        heading = own[:, [HX, HY]]
    along = own[:, [TAU_X, TAU_Y]] if states is not scene.states else turns.along_wall
    modes = np.stack([along, -along], axis=1)
    single = np.stack([heading, np.zeros_like(heading)], axis=1)
    base = np.where(steps.follows[:, None, None], modes, single)
    if len(view.spin):
        spin = view.spin[steps.rows]
        base = turned_by(base, np.arctan2(spin[:, 1], spin[:, 0])[:, None])
    toward, angle = view.toward[steps.rows], view.angle_sr[steps.rows]
    whole = view.whole_rad[steps.rows] if len(view.whole_rad) else view.whole_rad
    is_turned = bool(back.any())
    return Draw(
        sight=Sight(partial(_seen, steps, states, heading, back if is_turned else None)),
        base=turned_by(base, back[:, None]) if is_turned else base,
        toward=turned_by(toward, back[:, None]) if is_turned else toward,
        angle_sr=angle,
        whole_rad=whole,
    )


def _seen(steps: Steps, states: Floats, heading: Floats, back: Floats | None) -> Seen:
    """Return what was seen, from all states and the own headings, turned back by some angles."""
    made = _seen_as_drawn(steps, states, heading)
    return made if back is None else _turned_back(made, back)


def _seen_as_drawn(steps: Steps, states: Floats, heading: Floats) -> Seen:
    """Return that with directions as they were drawn."""
    turns = steps.turns
    at = turns.at
    own, columns = states[at, :, turns.who], states.shape[2]
    each = [[j for j in range(columns) if j != i] for i in range(columns)]
    others = np.array(each, dtype=np.int64)[turns.who]
    rows = np.arange(len(at))[:, None]

    def theirs(row: int, when: NDArray[np.int64]) -> Floats:
        return np.asarray(states[when[:, None], row, others])

    # What is kept by functions of the past holds as little as it can: neither `own` nor `states`.
    own_xy, places = own[:, [X, Y]], np.ascontiguousarray(states[:, : ZONE + 1])

    def to(when_x: Floats, when_y: Floats) -> tuple[Floats, Floats]:
        away = np.stack([when_x - own_xy[:, :1], when_y - own_xy[:, 1:]], axis=-1)
        distance = np.linalg.norm(away, axis=-1)
        return away / np.maximum(distance, 1e-9)[..., None], distance

    # Where positions are exact there is one draw, and what is asked of it again and again is kept.
    kept = cache if states is steps.scene.states else _as_it_is
    here = theirs(ZONE, at) > 0
    now_x, now_y = theirs(X, at), theirs(Y, at)
    bearing, distance = to(now_x, now_y)
    present = here[..., None]

    packed = pack([without_effects(steps.parameters)], steps.scene.arena)
    cos_fov = float(packed.cos_fov[0])
    toward, angle = perceive(states, at, turns.who, 0.0, cos_fov, False)
    now_toward = toward[rows, others]

    def there(ago: int) -> tuple[Floats, Floats, NDArray[np.bool_]]:
        """Return where others were so many samples before, and whether they were in the tank."""
        when = np.maximum(at - ago, 0)[:, None]
        return places[when, X, others], places[when, Y, others], places[when, ZONE, others] > 0

    def shortly_ago(ago: float) -> Floats:
        """Return where the base law draws to, by where all were some steps before.

        By where they are, for those that were not in the tank then.
        """
        share, whole = math.modf(ago)
        x, y, was = there(int(whole))
        if share > 0:
            more_x, more_y, was_more = there(int(whole) + 1)
            x, y = (1 - share) * x + share * more_x, (1 - share) * y + share * more_y
            was &= was_more
        way, away_m = to(x, y)
        way = np.where(away_m < REPULSION_M, -1.0, 1.0)[..., None] * way
        return np.where(present & was[..., None], way, now_toward)

    def sight_ago(ago: float) -> Floats:
        return np.asarray(perceive(places, at, turns.who, ago, cos_fov, False)[0][rows, others])

    def attention_ago(ago: float) -> Floats:
        _, angle = perceive(places, at, turns.who, ago, cos_fov, False)
        return np.asarray(steps.alpha[:, None] * angle[rows, others])

    def ago(steps: float) -> Floats:
        made = np.empty_like(toward)
        head_late(places, at, turns.who, steps, 0.0, False, toward, made)
        return np.asarray(made[rows, others])

    def then(steps: float) -> Floats:
        made = np.empty_like(toward)
        head_late(places, at, turns.who, steps, REPULSION_M, True, toward, made)
        return np.asarray(made[rows, others])

    who, dt_s = turns.who, steps.scene.dt_s

    def mean_speeds(over_s: float) -> tuple[Floats, Floats]:
        mean = mean_speed(places[:, SPEED], places[:, ZONE] > 0, over_s / dt_s)
        return mean[at[:, None], others], mean[at, who]

    cross = heading[:, None, 0] * bearing[..., 1] - heading[:, None, 1] * bearing[..., 0]
    dot = (heading[:, None] * bearing).sum(axis=-1)
    past = own[:, [PAST_HX, PAST_HY]]
    turned = np.arctan2(
        past[:, 0] * heading[:, 1] - past[:, 1] * heading[:, 0], (past * heading).sum(axis=1)
    )
    left_here = here & (theirs(LEFT_FROM, at) == own[:, ROOM, None]) & (own[:, ROOM, None] > 0)
    since_s = own[:, TIME, None] - theirs(LEFT_AT_S, at)
    return Seen(
        attention=steps.alpha[:, None] * angle[rows, others],
        toward=now_toward,
        shortly_ago_toward=kept(shortly_ago),
        sight_ago=kept(sight_ago),
        attention_ago=cache(attention_ago),  # It is asked most, and is half as large.
        ago_toward=ago,
        then_toward=then,
        bearing=bearing * present,
        distance_m=np.where(here, distance, AWAY_M),
        off_axis_rad=np.abs(np.arctan2(cross, dot)),
        speed_m_s=theirs(SPEED, at),
        lately_m_s=lately(states, steps.scene.dt_s)[at[:, None], others],
        mean_speeds_m_s=mean_speeds,
        heading=np.stack([theirs(HX, at), theirs(HY, at)], axis=-1) * present,
        course=courses(states, steps.scene.dt_s)[at[:, None], others] * present,
        here=here,
        too_near=here & (distance < REPULSION_M),
        in_sight=angle[rows, others] > 0,
        is_robot=(theirs(KIND, at) > 0) & here,
        other=np.where(here, steps.scene.tracks[at[:, None], others], -1),
        own_heading=heading,
        x_axis=np.broadcast_to((1.0, 0.0), heading.shape),
        along_wall=own[:, [TAU_X, TAU_Y]],
        way_out=np.where(own[:, [ROOM]] > 0, own[:, [MOUTH_X, MOUTH_Y]], 0.0),
        xy_m=own_xy,
        follows_walls=steps.follows,
        zone=turns.zone,
        track=turns.track,
        own_speed_m_s=turns.speed_m_s,
        last_speed_m_s=own[:, SPEED].copy(),  # A view would keep all of `own`.
        last_turn_rad=turned,
        ago_heading=ago_heading(states, at, turns.who),
        recent_turn_rad=recent_turn(states, at, turns.who),
        time=at / max(1, len(steps.scene.k) - 1),
        left_s=np.where(own[:, ROOM] > 0, own[:, LEFT_S], np.inf),
        each_left_s=np.where(left_here, since_s, np.inf),
        in_open=in_open(states, steps.scene.dt_s)[at[:, None], others],
        straight_s=straight(states, steps.scene.dt_s)[at, turns.who],
        stayed_s=stayed(states, steps.scene.tracks, steps.scene.dt_s)[at, turns.who],
    )


def _as_it_is(function: Callable[[float], Floats]) -> Callable[[float], Floats]:
    """Return a function that works out anew whatever it is asked."""
    return function


def _turned_back(seen: Seen, back: Floats) -> Seen:
    """Return what was seen with all directions turned, so that headings are the measured ones."""
    b = back[:, None]
    # Functions of `seen` itself would keep all of it.
    ago, then = seen.ago_toward, seen.then_toward
    shortly_ago, sight_ago = seen.shortly_ago_toward, seen.sight_ago
    return replace(
        seen,
        toward=turned_by(seen.toward, b),
        shortly_ago_toward=lambda share: turned_by(shortly_ago(share), b),
        sight_ago=lambda steps: turned_by(sight_ago(steps), b),
        ago_toward=lambda steps: turned_by(ago(steps), b),
        then_toward=lambda steps: turned_by(then(steps), b),
        bearing=turned_by(seen.bearing, b),
        heading=turned_by(seen.heading, b),
        course=turned_by(seen.course, b),
        own_heading=turned_by(seen.own_heading, back),
        ago_heading=turned_by(seen.ago_heading, back),
        along_wall=turned_by(seen.along_wall, back),
        way_out=turned_by(seen.way_out, back),
        x_axis=turned_by(seen.x_axis, back),
    )
