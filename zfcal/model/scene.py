"""Measured tracks as the states that agents decided in, with all that effects may ask.

A scene holds the whole state of everybody at each sample, as the kernels of a simulation have
it, so that an effect's own compiled functions give its likelihood.
"""

from __future__ import annotations

import heapq
import math
from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray

from zfcal.arena import Arena
from zfcal.arrays import Floats, Ints
from zfcal.errors import InputError
from zfcal.model.kernels.landing import ANGLES, PER_CELL, landing_shares
from zfcal.model.kernels.scene import fill_states
from zfcal.model.kernels.state import HX, HY, SPEED, TAU_X, TAU_Y, ZONE, X, Y
from zfcal.model.tank import tank_of
from zfcal.tracks import FISH, Samples
from zfcal.units import HEADING_MIN_STEP_M

_MIN_SAMPLES = 3


@dataclass(frozen=True, slots=True, kw_only=True)
class Moves:
    """Steps of fish, sorted by sample.

    Parameters
    ----------
    at, who : ndarray of int64, shape (step,)
        Sample and column of the states in which the step begins.
    track : ndarray of int32, shape (step,)
        Track id.
    zone : ndarray of int64, shape (step,)
        Zone id at the start.
    speed_m_s : ndarray, shape (step,)
    """

    at: Ints
    who: Ints
    track: NDArray[np.int32]
    zone: Ints
    speed_m_s: Floats

    def __len__(self) -> int:
        return len(self.at)


@dataclass(frozen=True, slots=True, kw_only=True)
class Turns(Moves):
    """Steps of fish with a heading before and after.

    Parameters
    ----------
    landing : ndarray of int64, shape (step,)
        Zone id at the end.
    heading, taken, along_wall : ndarray, shape (step, 2)
        Unit vectors: before, after, and along the wall.
    share : ndarray of uint8, shape (step, ANGLES, zone)
        For each cell of headings, how many of its 4 places land in each zone at the step's
        speed.
    """

    landing: Ints
    heading: Floats
    taken: Floats
    along_wall: Floats
    share: NDArray[np.uint8]

    def take(self, rows: NDArray[np.bool_] | NDArray[np.intp]) -> Turns:
        """Return the chosen steps."""
        return Turns(**{f.name: getattr(self, f.name)[rows] for f in fields(self)})


@dataclass(frozen=True, slots=True, kw_only=True)
class Scene:
    """Everybody's state at every sample, and the steps that can be judged.

    Parameters
    ----------
    arena
        Where it was.
    dt_s
        The step.
    k : ndarray of int64, shape (sample,)
        Sample numbers.
    states : ndarray, shape (sample, state, column)
        Rows as in `zfcal.model.kernels.state`. Tracks that do not overlap share a column.
    tracks : ndarray of int32, shape (sample, column)
        Track ids; -1 where nobody is.
    turns
        Fish that have a heading before and after the step.
    moves
        Fish whose speed before is known: frozen ones as well.
    n_fish, n_robots
        Most of them at a time.
    """

    arena: Arena
    dt_s: float
    k: Ints
    states: Floats
    tracks: NDArray[np.int32]
    turns: Turns
    moves: Moves
    n_fish: int
    n_robots: int

    @property
    def duration_s(self) -> float:
        """Time from the first sample to the last, in seconds."""
        return len(self.k) * self.dt_s

    def time_s(self, steps: Moves) -> Floats:
        """Return when each step began, in seconds of the trial, shape (step,)."""
        return np.asarray(self.k[steps.at] * self.dt_s)


def make_scene(samples: Samples, arena: Arena) -> Scene:
    """Return the states and steps of measured tracks.

    A step counts where its agent has one track id at three samples in a row, inside the
    tank and none of them a guess, never interpolated. What is guessed is seen by the others all the
    same: it is there, and from near.

    Parameters
    ----------
    samples
        Positions on the model's clock.
    arena
        A position a little outside counts as at the wall.

    Raises
    ------
    InputError
        There are no fish, or fewer than three samples.
    """
    if not (samples.kind == FISH).any() or len(samples.k) < _MIN_SAMPLES:
        raise InputError(
            f"A likelihood needs fish at three samples in a row, got {len(samples.k)} samples of "
            f"{int((samples.kind == FISH).sum())} fish and {int((samples.kind != FISH).sum())} "
            f"robots."
        )
    xy, _ = arena.settle(samples.xy_m)
    columns, kinds = _columns(~np.isnan(xy[..., 0]), samples.kind)
    folded, tracks = _fold(xy, columns, samples.agent, len(kinds))
    sure = tracks >= 0
    at, track = np.nonzero(samples.guessed)
    sure[at, columns[track]] = False
    states = fill_states(
        np.ascontiguousarray(folded),
        kinds.astype(np.float64),
        (float(samples.k[0] * samples.dt_s), samples.dt_s),
        HEADING_MIN_STEP_M,
        tank_of(arena),
    )
    speed = states[:, SPEED].copy()
    unknown = np.isnan(speed)
    # An unknown speed is taken for a middling one, so that it draws nobody's attention.
    states[:, SPEED][unknown] = np.nanmean(speed) if not unknown.all() else 0.0
    present = states[:, ZONE] > 0
    by_kind = [int(present[:, kinds == kind].sum(axis=1).max(initial=0)) for kind in (0, 1)]
    parts = _Parts(states=states, speed=speed, kinds=kinds, tracks=tracks, sure=sure)
    return Scene(
        arena=arena,
        dt_s=samples.dt_s,
        k=samples.k.astype(np.int64),
        states=states,
        tracks=tracks,
        turns=_turns(parts, arena, samples.dt_s),
        moves=_moves(parts),
        n_fish=by_kind[0],
        n_robots=by_kind[1],
    )


def _columns(seen: NDArray[np.bool_], kind: NDArray[np.int8]) -> tuple[Ints, NDArray[np.int8]]:
    """Return a column for each track, and the columns' kinds.

    A track takes over a column that was empty for a sample or more.
    """
    order = np.argsort(seen.argmax(axis=0), kind="stable")
    free: dict[int, list[tuple[int, int]]] = {0: [], 1: []}
    kinds: list[int] = []
    columns = np.full(len(kind), -1, dtype=np.int64)
    for track in order:
        if not seen[:, track].any():
            continue
        own = int(kind[track])
        first = int(seen[:, track].argmax())
        last = len(seen) - 1 - int(seen[::-1, track].argmax())
        if free[own] and free[own][0][0] + 1 < first:
            column = heapq.heappop(free[own])[1]
        else:
            column = len(kinds)
            kinds.append(own)
        columns[track] = column
        heapq.heappush(free[own], (last, column))
    return columns, np.array(kinds, dtype=np.int8)


def _fold(
    xy: Floats, columns: Ints, ids: NDArray[np.int32], n_columns: int
) -> tuple[Floats, NDArray[np.int32]]:
    """Return positions and track ids by column; ids -1 where nobody is."""
    folded = np.full((len(xy), n_columns, 2), np.nan)
    tracks = np.full((len(xy), n_columns), -1, dtype=np.int32)
    for track in np.flatnonzero(columns >= 0):
        rows = ~np.isnan(xy[:, track, 0])
        folded[rows, columns[track]] = xy[rows, track]
        tracks[rows, columns[track]] = ids[track]
    return folded, tracks


@dataclass(frozen=True, slots=True, kw_only=True)
class _Parts:
    states: Floats
    speed: Floats
    kinds: NDArray[np.int8]
    tracks: NDArray[np.int32]
    sure: NDArray[np.bool_]

    def usable(self) -> tuple[Ints, Ints]:
        """Return sample and column of the steps of fish with a known speed before and after.

        The speed of a guess, or out of one, is not known.
        """
        known = ~np.isnan(self.speed) & self.sure
        known[1:] &= self.sure[:-1]
        rows = known[:-1] & known[1:] & (self.kinds == FISH)[None, :]
        at, who = np.nonzero(rows)
        return at.astype(np.int64), who.astype(np.int64)


def _moves(parts: _Parts) -> Moves:
    at, who = parts.usable()
    return Moves(
        at=at,
        who=who,
        track=parts.tracks[at, who],
        zone=parts.states[at, ZONE, who].astype(np.int64),
        speed_m_s=parts.speed[at + 1, who],
    )


def _turns(parts: _Parts, arena: Arena, dt_s: float) -> Turns:
    at, who = parts.usable()
    least = HEADING_MIN_STEP_M / dt_s * (1 - 1e-12)
    long = (parts.speed[at, who] >= least) & (parts.speed[at + 1, who] >= least)
    at, who = at[long], who[long]
    states = parts.states
    own, then = states[at, :, who], states[at + 1, :, who]
    reach = parts.speed[at + 1, who] * dt_s
    xy = np.ascontiguousarray(own[:, [X, Y]])
    share = landing_shares(xy, reach, tank_of(arena), len(arena.zones), ANGLES, PER_CELL)
    turns = Turns(
        at=at,
        who=who,
        track=parts.tracks[at, who],
        zone=own[:, ZONE].astype(np.int64),
        speed_m_s=parts.speed[at + 1, who],
        landing=then[:, ZONE].astype(np.int64),
        heading=np.ascontiguousarray(own[:, [HX, HY]]),
        taken=np.ascontiguousarray(then[:, [HX, HY]]),
        along_wall=np.ascontiguousarray(own[:, [TAU_X, TAU_Y]]),
        share=share,
    )
    # A jump into a far corner can miss it at all headings that are looked at.
    return turns.take(np.flatnonzero(share.any(axis=(1, 2))))


def thin(scene: Scene, rows: NDArray[np.bool_], moves: NDArray[np.bool_]) -> Scene:
    """Return the same states with some of the steps left out.

    Parameters
    ----------
    rows : ndarray of bool, shape (turn,)
    moves : ndarray of bool, shape (move,)
    """
    kept = Moves(**{f.name: getattr(scene.moves, f.name)[moves] for f in fields(Moves)})
    return replace(scene, turns=scene.turns.take(rows), moves=kept)


def cos_of(fov_rad: float) -> float:
    """Return the cosine of a field of view; below -1 where everything is seen."""
    return -2.0 if fov_rad >= math.pi else math.cos(fov_rad)
