"""What the agents of a scene saw, and what a model's effects make of it, turn by turn.

It comes from the very functions that a simulation calls; the base's parameters have no part.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from zfcal.arrays import Floats
from zfcal.model.blocks import in_blocks
from zfcal.model.directions import turned_by
from zfcal.model.effects import find_effect
from zfcal.model.kernels.effect_evaluation import (
    PART,
    ask_components,
    ask_factors,
    ask_harmonics,
    ask_rotations,
    ask_speeds,
    attend,
)
from zfcal.model.kernels.extended import harmonic_tilt
from zfcal.model.kernels.landing import ANGLES
from zfcal.model.kernels.perception import REPULSION_M
from zfcal.model.kernels.scene import head_late, perceive
from zfcal.model.kernels.state import (
    LATE_FELT_M,
    LATE_NEAR,
    LATE_PART,
    LATE_SHARE,
    LATE_THEN,
    LATE_WHOLE,
    Packed,
)
from zfcal.model.packing import pack
from zfcal.model.scene import Scene
from zfcal.parameters import Parameters

Late: TypeAlias = dict[tuple[float, bool], tuple[Floats, Floats]]
"""What was perceived so many steps late, and whether from where the fish itself was then."""


@dataclass(frozen=True, slots=True, kw_only=True)
class View:
    """What the steps' agents saw, and what the effects ask, as the kernels want it.

    Parameters
    ----------
    toward, angle_sr : ndarray, shape (step, column, 2) and (step, column)
        Unit vectors to neighbours and solid angles, with the effects on sight. Where a
        share of them is late, a second set of columns holds that share.
    spin : ndarray, shape (step, 2)
        Cosine and sine of the angle by which base directions are turned; empty where no
        effect turns them.
    whole_rad : ndarray, shape (step,)
        Angle by which all directions were turned, those of the base among them; empty likewise.
    seen_sr : ndarray, shape (step, agent)
        Solid angles as effects are given them.
    parts : ndarray, shape (step, component, 4)
        Components of effects: weight, unit vector, kappa.
    tilt, tilt_taken : ndarray, shape (step, cell) and (step,)
        Product of factors; empty where the model has none.
    """

    toward: Floats
    angle_sr: Floats
    parts: Floats
    tilt: Floats
    tilt_taken: Floats
    seen_sr: Floats
    spin: Floats
    whole_rad: Floats
    late: Late = dataclasses.field(default_factory=dict)
    """What was perceived late, so that a fit looks but once."""


def view_of(
    scene: Scene, parameters: Parameters, seen: View | None = None, *, n_workers: int = 1
) -> View:
    """Return what a model says of a scene's turns, but for the base's parameters.

    Parameters
    ----------
    parameters
        Its field of view and its effects count.
    seen
        A view of the model without effects, if there is one: sight is taken from it.
    n_workers
        Threads; the numbers do not depend on them.
    """
    packed = pack([parameters], scene.arena)
    share, all_late = packed.lates[0, LATE_SHARE], sees_late(packed)
    known = {} if seen is None else seen.late
    toward, angle = _perceived(scene, packed, known, all_late)
    own = angle
    if packed.lags[0] > 0 and share > 0.0 and not all_late:
        late_toward, late_angle = late_sight(scene, packed, known)
        toward = np.concatenate([toward, late_toward], axis=1)
        angle = np.concatenate([(1 - share) * angle, share * late_angle], axis=1)
    parts = components_of(scene, packed, own)
    form = polynomial_of(parameters.effects)
    if form is None:
        tilt, tilt_taken = factors_of(scene, packed, own, n_workers=n_workers)
    else:
        tilt, tilt_taken = smooth_factors_of(scene, packed, own, form, n_workers=n_workers)
    view = View(
        toward=toward,
        angle_sr=angle,
        parts=parts,
        tilt=tilt,
        tilt_taken=tilt_taken,
        seen_sr=own,
        spin=np.zeros((0, 2)),
        whole_rad=np.zeros(0),
        late=known,
    )
    return turned_view(view, *turns_of(scene, packed, own))


def turns_of(scene: Scene, packed: Packed, angle_sr: Floats) -> tuple[Floats, Floats]:
    """Return the angles that effects turn base directions by, and all; each empty without such."""
    turns, made = scene.turns, []
    for hooks in (packed.rotations, packed.whole_rotations):
        made.append(np.zeros(len(turns) if len(hooks) else 0))
        if len(hooks):
            ask_rotations(scene.states, turns.at, turns.who, packed, hooks, angle_sr, made[-1])
    return made[0], made[1]


def turned_view(view: View, base_rad: Floats, whole_rad: Floats) -> View:
    """Return a view whose directions are turned on to the left.

    Parameters
    ----------
    base_rad, whole_rad : ndarray, shape (step,)
        Those of the base alone, and all; empty for none.
    """
    if len(whole_rad):
        parts = view.parts.copy()
        parts[:, :, 1:3] = turned_by(parts[:, :, 1:3], whole_rad[:, None])
        view = dataclasses.replace(
            view,
            parts=parts,
            toward=turned_by(view.toward, whole_rad[:, None]),
            whole_rad=view.whole_rad + whole_rad if len(view.whole_rad) else whole_rad,
        )
    for angle in (base_rad, whole_rad):
        if len(angle):
            spin = view.spin if len(view.spin) else np.eye(2)[:1]
            view = dataclasses.replace(view, spin=turned_by(spin, angle))
    return view


def sees_late(packed: Packed) -> float:
    """Return by how many steps all that agents of a model see is late."""
    late = packed.lates[0]
    return lag_of(packed) if late[LATE_SHARE] >= 1.0 and late[LATE_WHOLE] > 0.0 else 0.0


def _is_then(packed: Packed) -> bool:
    """Return whether what is seen late is seen from where the fish itself was."""
    return bool(packed.lates[0, LATE_THEN] > 0.0)


def lag_of(packed: Packed) -> float:
    """Return by how many steps a model's agents respond late."""
    return float(packed.lags[0] - 1.0 + packed.lates[0, LATE_PART])


def late_sight(scene: Scene, packed: Packed, known: Late) -> tuple[Floats, Floats]:
    """Return unit vectors and solid angles of neighbours as a model sees them that is late."""
    lag, late = lag_of(packed), packed.lates[0]
    if late[LATE_WHOLE] > 0.0:
        return _perceived(scene, packed, known, lag)
    toward, angle = _perceived(scene, packed, known, 0.0)
    turns, made = scene.turns, np.empty_like(toward)
    near_m = float(late[LATE_FELT_M])
    if late[LATE_NEAR] == 0.0:
        near_m = max(near_m, REPULSION_M)
    is_then = _is_then(packed)
    head_late(scene.states, turns.at, turns.who, lag, near_m, is_then, toward, made)
    return made, angle


def _perceived(scene: Scene, packed: Packed, known: Late, late: float) -> tuple[Floats, Floats]:
    """Return what is seen so many steps late, with a model's effects on sight."""
    key = (late, late > 0 and _is_then(packed))
    if key not in known:
        turns = scene.turns
        cos_fov = float(packed.cos_fov[0])
        known[key] = perceive(scene.states, turns.at, turns.who, late, cos_fov, key[1])
    toward, angle = known[key]
    return toward, attended(scene, packed, angle)


def attended(scene: Scene, packed: Packed, angle_sr: Floats) -> Floats:
    """Return solid angles as a model's effects on sight change them.

    Parameters
    ----------
    angle_sr : ndarray, shape (step, column)
        One set of columns of the scene, or several side by side.
    """
    if not len(packed.sights):
        return angle_sr
    turns, n = scene.turns, scene.states.shape[2]
    sets = []
    for first in range(0, angle_sr.shape[1], n):
        own = np.ascontiguousarray(angle_sr[:, first : first + n])
        sets.append(np.empty_like(own))
        attend(scene.states, turns.at, turns.who, packed, own, sets[-1])
    return np.concatenate(sets, axis=1)


def angles_of_moves(scene: Scene, packed: Packed) -> Floats:
    """Return the solid angles at which a model's agents saw others before each move.

    As a simulation has them when it asks for a speed: late where all that is seen is, and with the
    effects on sight.

    Returns
    -------
    ndarray, shape (move, agent)
    """
    moves, late = scene.moves, sees_late(packed)
    is_then = late > 0 and _is_then(packed)
    cos_fov = float(packed.cos_fov[0])
    _, angle = perceive(scene.states, moves.at, moves.who, late, cos_fov, is_then)
    if not len(packed.sights):
        return angle
    changed = np.empty_like(angle)
    attend(scene.states, moves.at, moves.who, packed, angle, changed)
    return changed


def speed_factor(scene: Scene, packed: Packed, angle_sr: Floats | None = None) -> Floats:
    """Return by what a model's effects multiply the speed of each move, shape (move,).

    Parameters
    ----------
    angle_sr : ndarray, shape (move, agent)
        What was seen before each, from `angles_of_moves`; by default as this model sees.
    """
    moves, factor = scene.moves, np.ones(len(scene.moves))
    if len(packed.speeds):
        seen = angles_of_moves(scene, packed) if angle_sr is None else angle_sr
        ask_speeds(scene.states, moves.at, moves.who, packed, seen, factor)
    return factor


def components_of(scene: Scene, packed: Packed, angle_sr: Floats) -> Floats:
    """Return the effects' components for each turn, shape (step, component, 4)."""
    turns = scene.turns
    parts = np.zeros((len(turns), len(packed.components), PART))
    if len(packed.components):
        ask_components(scene.states, turns.at, turns.who, packed, angle_sr, parts)
    return parts


def factors_of(
    scene: Scene,
    packed: Packed,
    angle_sr: Floats,
    probability: Floats | None = None,
    *,
    n_workers: int = 1,
) -> tuple[Floats, Floats]:
    """Return the effects' factors on each cell and at the heading taken; empty without.

    Parameters
    ----------
    probability : ndarray, shape (turn, cell)
        Where it is given, cells that hardly any heading takes have a factor of one.
    n_workers
        Threads; the numbers do not depend on them.
    """
    turns = scene.turns
    if not len(packed.factors):
        return np.zeros((0, ANGLES)), np.zeros(0)
    tilt, taken = np.empty((len(turns), ANGLES)), np.empty(len(turns))
    likely = np.zeros((0, ANGLES)) if probability is None else probability

    def ask(own: slice) -> None:
        ask_factors(
            scene.states, turns.at[own], turns.who[own], packed, angle_sr[own], turns.taken[own],
            turns.speed_m_s[own], turns.landing[own], turns.share[own],
            likely[own] if len(likely) else likely, tilt[own], taken[own],
        )  # fmt: skip

    in_blocks(len(turns), n_workers, ask)
    return tilt, taken


@dataclass(frozen=True, slots=True)
class Polynomial:
    """What the log of factors is: a trigonometric polynomial of the heading.

    Parameters
    ----------
    degree
        Of it.
    by_landing
        Whether a number of the landing zone is added.
    """

    degree: int
    by_landing: bool


def polynomial_of(effects: Mapping[str, Mapping[str, float]]) -> Polynomial | None:
    """Return what the log of the product of effects' factors is; None where one is none.

    Parameters
    ----------
    effects
        Parameters of each, by its name.
    """
    factors = {name: find_effect(name) for name in effects if find_effect(name).factor is not None}
    degrees = [effect.degree(effects[name]) for name, effect in factors.items()]
    known = [degree for degree in degrees if degree is not None]
    if len(known) < len(degrees):
        return None
    by_landing = any(effect.by_landing for effect in factors.values())
    return Polynomial(max(known, default=0), by_landing)


def harmonics(
    scene: Scene, packed: Packed, angle_sr: Floats, form: Polynomial, *, n_workers: int = 1
) -> tuple[Floats, Floats, Floats]:
    """Return the log of the effects' factors as a polynomial, and at the heading taken.

    Parameters
    ----------
    form
        What the log of their product is.
    n_workers
        Threads; the numbers do not depend on them.

    Returns
    -------
    waves, zones, log_taken
        As `zfcal.model.kernels.effect_evaluation.ask_harmonics` has them.
    """
    turns, n = scene.turns, len(scene.turns)
    waves, log_taken = np.empty((n, 1 + 2 * form.degree)), np.empty(n)
    zones = np.empty((n, turns.share.shape[2]))

    def ask(own: slice) -> None:
        ask_harmonics(
            scene.states, turns.at[own], turns.who[own], packed, angle_sr[own], turns.taken[own],
            turns.speed_m_s[own], turns.landing[own], form.by_landing, waves[own], zones[own],
            log_taken[own],
        )  # fmt: skip

    in_blocks(n, n_workers, ask)
    return waves, zones, log_taken


def smooth_factors_of(
    scene: Scene, packed: Packed, angle_sr: Floats, form: Polynomial, *, n_workers: int = 1
) -> tuple[Floats, Floats]:
    """Return what `factors_of` does, of factors that are polynomials in their log."""
    if not len(packed.factors):
        return np.zeros((0, ANGLES)), np.zeros(0)
    waves, zones, log_taken = harmonics(scene, packed, angle_sr, form, n_workers=n_workers)
    share, tilt = scene.turns.share, np.empty((len(scene.turns), ANGLES))

    def ask(own: slice) -> None:
        harmonic_tilt(waves[own], zones[own], share[own], tilt[own])

    in_blocks(len(tilt), n_workers, ask)
    return tilt, np.exp(log_taken)
