"""Boldness: individuals differ in how readily they leave."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np
import shapely

from zfcal.arena import Arena
from zfcal.arrays import Floats
from zfcal.model.effects.base import Company, Effect, EffectParameter, Shapes
from zfcal.model.effects.circumstances import by_circumstances, each_fish, each_under
from zfcal.model.effects.forms import tilt, way_out
from zfcal.model.effects.weights import aside_of, every_step, only, who
from zfcal.model.features import Component, Feature, Leaving, Seen, Tilt, Turned, Weights
from zfcal.model.kernels.compiled import hook
from zfcal.model.kernels.hats import hats
from zfcal.model.kernels.hooks import FACTOR
from zfcal.model.kernels.rooms import find_rooms, open_zone
from zfcal.model.kernels.state import CLEAR, DT_S, EXIT, ROOM, TRAIT, ZONE


@hook(FACTOR)
def factor(state, sight, n, i, parameters, ux, uy, speed, landing):  # type: ignore[no-untyped-def]  # noqa: ARG001
    """Weigh headings by the way out of a room; in a tank without rooms, out of the zone.

    Or by whether they land in a certain zone.
    """
    own = parameters[0] * state[TRAIT * n + i]
    if parameters[2] > 0.0:
        return tilt(own, 1.0 if landing == parameters[2] else -1.0, 1.0)
    if state[EXIT * n + i] > 0.0:
        if not state[ROOM * n + i] > 0.0:
            return 1.0
        return tilt(own, way_out(state, n, i, (ux, uy, landing), parameters[1]), 1.0)
    if speed * state[DT_S * n + i] < state[CLEAR * n + i]:
        return 1.0
    return tilt(own, 1.0 if landing != state[ZONE * n + i] else -1.0, 1.0)


_KAPPA = 4.0
_NEAR_M = 0.2


def _shapes(arena: Arena) -> Shapes:
    shares = (1.0, 0.0) if find_rooms(arena)[0] else (1.0,)
    return tuple({"heading_share": share} for share in shares)


def _open(arena: Arena) -> Shapes:
    """Return that bold ones swim into the open, if there is such a zone."""
    zone = open_zone(arena)
    return ({"heading_share": 0.0, "into_zone": float(zone)},) if zone else ()


def _lacks(company: Company) -> str | None:
    return None if company.n_fish > 1 else "a second fish"


_TIMES = (0.0, 0.5, 1.0)


def _who_by_time(seen: Seen) -> Floats:
    """Return what each fish has beside the first by the time: some leave from their moment on.

    Beside what all do alike by the time: where one is seldom asked, what all do would be gained
    by the others having less of it.
    """
    each = who(seen)
    first = 1.0 - each.sum(axis=1, keepdims=True)
    weights = (each - first)[..., None] * hats(seen.time, _TIMES)[:, None]
    return np.concatenate([_all_by_time(seen), weights.reshape(len(seen.time), -1)], axis=1)


def _all_by_time(seen: Seen) -> Floats:
    return hats(seen.time, _TIMES)[:, 1:]


def _nearness(between: shapely.Geometry, seen: Seen) -> Floats:
    """Return one at the way out of a room, less farther off, shape (step,)."""
    away_m = shapely.distance(between, shapely.points(seen.xy_m))
    return np.asarray(np.clip(1 - away_m / _NEAR_M, 0.0, 1.0) * _in_a_room(seen))


def _in_a_room(seen: Seen) -> Floats:
    """Return one where there is a way out, shape (step,)."""
    return np.asarray((seen.way_out != 0).any(axis=1), dtype=np.float64)


def _leaning(between: shapely.Geometry) -> Tilt:
    """Return that each fish leans to the way out in a measure of its own, near it and beyond."""

    def common(seen: Seen) -> Floats:
        near = _nearness(between, seen)
        return np.stack([near, 1 - near], axis=1)[..., None] * seen.way_out[:, None]

    def by_who(seen: Seen) -> Floats:
        each = seen.once(each_fish)[:, :, None, None] * common(seen)[:, None]
        return np.asarray(each.reshape(len(each), -1, 2))

    return Tilt(
        label="leaning to the way out, by who", vectors=by_who,
        over=Tilt(label="leaning to the way out", vectors=common), counts_whole=True,
    )  # fmt: skip


def _by_who(between: shapely.Geometry) -> tuple[Feature, ...]:
    """Return that each fish is drawn, or turns, to the way out in a measure of its own."""
    places: dict[str, Callable[[Seen], Floats]] = {
        "the way out": partial(_nearness, between),
        "the way out from anywhere": _in_a_room,
    }
    return tuple(make(*place) for place in places.items() for make in (_drawn, _turning))


def _drawn(name: str, where: Callable[[Seen], Floats]) -> Component:
    """Return that each fish is drawn to the way out in a measure of its own.

    By what all do alike no fish is bolder than another; where they differ both are boldness.
    """

    def component(label: str, weights: Weights, over: Component | None = None) -> Component:
        return Component(
            label=label, toward=lambda seen: only(seen.way_out),
            weights=lambda seen: only(weights(seen)), kappa=_KAPPA, over=over, counts_whole=True,
        )  # fmt: skip

    common = component(f"drawn to {name}", lambda seen: where(seen)[:, None])
    return component(f"drawn to {name}, by who", _each(where), common)


def _turning(name: str, where: Callable[[Seen], Floats]) -> Turned:
    """Return that each fish turns to the way out in a measure of its own."""

    def turned(label: str, weights: Weights, over: Turned | None = None) -> Turned:
        def by(seen: Seen) -> Floats:
            return weights(seen) * aside_of(seen, seen.way_out[:, None], along_walls=True)

        return Turned(label=label, by=by, neighbours=True, over=over, counts_whole=True)

    common = turned(f"turning to {name}", lambda seen: where(seen)[:, None])
    return turned(f"turning to {name}, by who", _each(where), common)


def _each(where: Callable[[Seen], Floats]) -> Weights:
    """Return a weight for each fish of its own, shape (step, fish)."""
    return lambda seen: np.asarray(seen.once(each_fish) * where(seen)[:, None])


def _crossing(between: shapely.Geometry) -> Tilt:
    """Return that each fish goes on between the rooms, or turns back, in a measure of its own."""

    def ahead(seen: Seen) -> Floats:
        inside = shapely.contains_xy(between, seen.xy_m).astype(np.float64)
        return inside[:, None] * seen.own_heading

    def by_who(seen: Seen) -> Floats:
        return np.asarray(seen.once(each_fish)[..., None] * ahead(seen)[:, None])

    return Tilt(
        label="going on between the rooms, by who", vectors=by_who,
        over=Tilt(label="going on between the rooms", vectors=lambda seen: ahead(seen)[:, None]),
    )  # fmt: skip


def _features(arena: Arena) -> tuple[Feature, ...]:
    """Return features of leaving, and of headings toward the way out where there is one."""
    made: list[Feature] = [
        Leaving(label="who", weights=who),
        Leaving(
            label="who, by the time",
            weights=_who_by_time,
            over=Leaving(label="by the time", weights=_all_by_time),
        ),
        by_circumstances(
            Leaving(label="who", weights=who),
            alone=each_under(Leaving(label="all", weights=every_step)),
            without=("who", "the time", "the zone"),
        ),
        Leaving(label="who, into the open", weights=who, into="open"),
    ]
    number = find_rooms(arena)[0]
    between = arena.zones[number - 1].polygon if number else None
    if between is not None:
        made += [Leaving(label="who, between the rooms", weights=who, into="again")]
        made += [_leaning(between), *_by_who(between), _crossing(between)]
    return tuple(made)


EFFECT = Effect(
    name="boldness",
    says="Some fish leave a place far more readily than others, all the time.",
    reference="Wilson et al. 1994, Trends in Ecology and Evolution 9: 442-446",
    parameters=(
        EffectParameter(
            name="spread",
            low=0.0,
            high=3.0,
            default=0.7,
            says="Standard deviation between fish of the log preference for the way out.",
        ),
        EffectParameter(
            name="heading_share",
            low=0.0,
            high=1.0,
            default=1.0,
            says="1: headings toward a room's way out, all over the room; 0: steps across it.",
        ),
        EffectParameter(
            name="into_zone",
            low=0.0,
            high=16.0,
            default=0.0,
            says="Number of the arena's zone, from 1 on, that bold fish swim into more readily; 0: "
            "they leave rooms.",
        ),
    ),
    strength="spread",
    probe=0.01,
    factor=factor,
    harmonics=1,
    by_landing=True,
    shapes=_shapes,
    further_shapes=_open,
    lacks=_lacks,
    identity_s=300.0,
    by_trait=True,
    fixed=("heading_share", "into_zone"),
    features=_features,
)
