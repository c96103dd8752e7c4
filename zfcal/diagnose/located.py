r"""Where a model and measured tracks disagree: which statistic, zone, time and agents.

Every statistic of the `battery` is summed over the whole recording and over its parts.
The rate of false discoveries among all of them is controlled by the procedure of Benjamini
and Hochberg (1995, Journal of the Royal Statistical Society B 57: 289-300). The spread of
a sum is that of the model's own law; noise of the tracker makes it larger, so a caller that
has null replicates gives centre and spread of each.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from zfcal.arrays import Floats, Ints
from zfcal.diagnose.battery import Steps, heading_statistics, speed_statistics
from zfcal.diagnose.findings import Located
from zfcal.diagnose.null import moments_of
from zfcal.diagnose.standing import Standing
from zfcal.model.scene import Moves, Scene

MOST = 12
MOST_OF_ONE = 3
"""Places that are named for one statistic."""

Q_MAX = 0.05
_BLOCK_S = 60.0
_MOST_BLOCKS = 20
_LEAST_STEPS = 50
_PRIOR_WEIGHT = 10.0
"""Replicates for which the model's own law counts, where their spread is taken."""

_ALL = -1


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Residuals:
    """Sums of a battery of statistics over a recording and over its parts.

    Parameters
    ----------
    names, zones, ids
        Names of the statistics, of the zones, and track ids.
    statistic, zone, block, agent : ndarray of int64, shape (part,)
        Places in these, and number of the time block; -1 for all of them.
    count, observed, expected, variance : ndarray, shape (part,)
        Number of steps, and sums over them.
    edges_s : ndarray, shape (block + 1,)
        Where the time blocks begin and end.
    """

    names: tuple[str, ...]
    zones: tuple[str, ...]
    ids: tuple[int, ...]
    statistic: Ints
    zone: Ints
    block: Ints
    agent: Ints
    count: Ints
    observed: Floats
    expected: Floats
    variance: Floats
    edges_s: Floats

    def __len__(self) -> int:
        return len(self.statistic)

    @property
    def z(self) -> Floats:
        """Differences in standard errors of the model's own law, shape (part,)."""
        return np.asarray((self.observed - self.expected) / np.sqrt(self.variance))

    @property
    def keys(self) -> list[tuple[str, int, bool, bool]]:
        """Statistic, zone, and whether it is a time block or an agent, of each part.

        Parts of one key have one centre and one spread in null replicates.
        """
        return [
            (self.names[s], int(z), bool(b != _ALL), bool(a != _ALL))
            for s, z, b, a in zip(self.statistic, self.zone, self.block, self.agent, strict=True)
        ]


def residuals(standing: Standing) -> Residuals:
    """Return the residuals of the battery, summed over the recording and its parts.

    Parameters
    ----------
    standing
        The scene under the model that is doubted.
    """
    scene = standing.scene
    edges_s = _edges(scene)
    ids = np.unique(scene.moves.track)
    names: list[str] = []
    parts: list[_Sums] = []
    for steps, found in (
        (scene.turns, heading_statistics(standing)),
        (scene.moves, speed_statistics(standing)),
    ):
        split = _split(scene, steps, edges_s, ids)
        for each in found:
            parts.extend(_sums(each, split, len(names)))
            names.append(each.statistic)
    joined = {f.name: np.concatenate([getattr(p, f.name) for p in parts]) for f in fields(_Sums)}
    return Residuals(
        names=tuple(names),
        zones=scene.arena.zone_names,
        ids=tuple(map(int, ids)),
        edges_s=edges_s,
        **joined,
    )


def _edges(scene: Scene) -> Floats:
    """Return borders of time blocks of a minute, longer where there would be more than 20."""
    n = int(np.clip(scene.duration_s // _BLOCK_S, 1, _MOST_BLOCKS))
    start_s = float(scene.k[0]) * scene.dt_s
    return np.linspace(start_s, start_s + scene.duration_s, n + 1)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Sums:
    statistic: Ints
    zone: Ints
    block: Ints
    agent: Ints
    count: Ints
    observed: Floats
    expected: Floats
    variance: Floats


@dataclass(frozen=True, slots=True, kw_only=True)
class _Split:
    """Which zone, time block and agent each step belongs to, from 0, and how many there are."""

    zone: Ints
    block: Ints
    agent: Ints
    sizes: tuple[int, int, int]


def _split(scene: Scene, steps: Moves, edges_s: Floats, ids: NDArray[np.int32]) -> _Split:
    block = np.searchsorted(edges_s, scene.time_s(steps), side="right") - 1
    return _Split(
        zone=steps.zone - 1,
        block=np.clip(block, 0, len(edges_s) - 2),
        agent=np.searchsorted(ids, steps.track).astype(np.int64),
        sizes=(len(scene.arena.zones), len(edges_s) - 1, len(ids)),
    )


def _sums(steps: Steps, split: _Split, number: int) -> Iterator[_Sums]:
    rows = np.flatnonzero(steps.rows)
    at = (split.zone[rows], split.block[rows], split.agent[rows])
    cell, n = np.ravel_multi_index(at, split.sizes), math.prod(split.sizes)
    finest = [
        np.bincount(cell, values, n).reshape(split.sizes)
        for values in (None, *(v[rows] for v in (steps.observed, steps.expected, steps.variance)))
    ]
    for kept in ((0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 1, 0), (0, 0, 1)):
        over = tuple(axis for axis, keep in enumerate(kept) if not keep)
        whole = [values.sum(axis=over, keepdims=True) for values in finest]
        count, observed, expected, variance = whole
        enough = np.nonzero((count >= _LEAST_STEPS) & (variance > 1e-9 * count))
        size = len(enough[0])
        where = [p if keep else np.full(size, _ALL) for p, keep in zip(enough, kept)]  # noqa: B905
        yield _Sums(
            statistic=np.full(size, number),
            zone=where[0], block=where[1], agent=where[2], count=count[enough].astype(np.int64),
            observed=observed[enough], expected=expected[enough], variance=variance[enough],
        )  # fmt: skip


def centre_and_spread(table: Residuals, nulls: Sequence[Residuals]) -> tuple[Floats, Floats]:
    """Return centre and spread of each part's z under the null, from replicates.

    Time blocks of a statistic and zone share them, and so do agents: that is what few
    replicates can tell.

    Parameters
    ----------
    table
        Of the measured tracks.
    nulls
        Of simulations of the fitted model through the same measurement, refitted; of a
        part that none of them has, centre 0 and spread 1.

    Returns
    -------
    centre, spread : ndarray, shape (part,)
    """
    values: dict[tuple[str, int, bool, bool], list[float]] = {}
    for null in nulls:
        for key, z in zip(null.keys, null.z, strict=True):
            values.setdefault(key, []).append(float(z))
    known = {key: _moments(np.array(z)) for key, z in values.items()}
    found = np.array([known.get(key, (0.0, 1.0)) for key in table.keys]).reshape(-1, 2)
    return found[:, 0], found[:, 1]


def _moments(z: Floats) -> tuple[float, float]:
    """Return the mean of replicates, and the standard deviation of one more about it.

    It is drawn toward the 1 of the model's own law, and not less than that: what a fit has
    taken off a statistic's spread it takes off otherwise where noise has shifted the fit.
    """
    moments = moments_of(z[:, None], _PRIOR_WEIGHT)
    wide = replace(moments, variance=np.maximum(moments.variance, 1.0))
    return float(moments.centre[0]), float(wide.spread_of_one_more(z.size)[0])


def located(
    table: Residuals,
    centre: Floats | float = 0.0,
    spread: Floats | float = 1.0,
    *,
    most: int = MOST,
) -> tuple[Located, ...]:
    """Return the parts in which model and data disagree, the clearest first.

    Neighbouring time blocks that disagree in the same sense are taken together, and of
    parts that hold one another the clearest is named alone.

    Parameters
    ----------
    table
        Of the measured tracks.
    centre, spread : ndarray, shape (part,)
        Of each part's z under the null; see `centre_and_spread`.
    most
        At most so many.
    """
    # Slow to import, and needed here alone.
    from scipy.stats import false_discovery_control

    if not len(table):
        return ()
    z = (table.z - centre) / spread
    q = false_discovery_control(2 * ndtr(-np.abs(z)))
    found = [_merge(table, rows, z, q) for rows in _runs(table, z, q)]
    found.sort(key=lambda each: -abs(each[0].z))
    kept: list[tuple[Located, _Place]] = []
    for each, place in found:
        same = [other for seen, other in kept if seen.statistic == each.statistic]
        if len(same) < MOST_OF_ONE and not any(_nested(place, other) for other in same):
            kept.append((each, place))
    return tuple(each for each, _ in kept[:most])


@dataclass(frozen=True, slots=True)
class _Place:
    zone: int
    blocks: tuple[int, int] | None
    agent: int


def _nested(one: _Place, other: _Place) -> bool:
    """Tell whether one place holds the other, or they overlap in all that both name."""
    zones = _ALL in (one.zone, other.zone) or one.zone == other.zone
    agents = _ALL in (one.agent, other.agent) or one.agent == other.agent
    if one.blocks is None or other.blocks is None:
        return zones and agents
    times = one.blocks[0] <= other.blocks[1] and other.blocks[0] <= one.blocks[1]
    return zones and agents and times


def _runs(table: Residuals, z: Floats, q: Floats) -> Iterator[Ints]:
    """Yield parts that are false discoveries at less than `Q_MAX`, time blocks in runs."""
    rows = np.flatnonzero(q <= Q_MAX)
    order = np.lexsort((table.block[rows], table.agent[rows], table.zone[rows],
                        table.statistic[rows]))  # fmt: skip
    run: list[int] = []
    for row in rows[order]:
        if run and not _continues(table, z, run[-1], int(row)):
            yield np.array(run)
            run = []
        run.append(int(row))
    if run:
        yield np.array(run)


def _continues(table: Residuals, z: Floats, last: int, row: int) -> bool:
    same = all(values[last] == values[row] for values in (table.statistic, table.zone, table.agent))
    blocks = table.block[last] != _ALL and table.block[row] == table.block[last] + 1
    return bool(same and blocks and z[last] * z[row] > 0)


def _merge(table: Residuals, rows: Ints, z: Floats, q: Floats) -> tuple[Located, _Place]:
    """Return a run of parts as one, with z of the sum of all their residuals."""
    first, last = int(rows[0]), int(rows[-1])
    weight = np.sqrt(table.variance[rows])
    whole = float((z[rows] * weight).sum() / np.sqrt((weight**2).sum()))
    count = float(table.count[rows].sum())
    block = (int(table.block[first]), int(table.block[last]))
    timed, agent = block[0] != _ALL, int(table.agent[first])
    zone = int(table.zone[first])
    span = (block[0], block[1] + 1) if timed else (0, len(table.edges_s) - 1)
    found = Located(
        statistic=table.names[table.statistic[first]],
        zone=None if zone == _ALL else table.zones[zone],
        time_s=(float(table.edges_s[span[0]]), float(table.edges_s[span[1]])),
        agents=None if agent == _ALL else (table.ids[agent],),
        observed=float(table.observed[rows].sum() / count),
        expected=float(table.expected[rows].sum() / count),
        z=whole,
        q=float(q[rows].min()),
    )
    return found, _Place(zone, block if timed else None, agent)
