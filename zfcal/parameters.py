"""The parameters of a model, as the model file states them, and as genes.

Reading and writing the file is in ``artifacts``; what they do is in ``model``.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from types import MappingProxyType

import numpy as np
from numpy.typing import ArrayLike

from zfcal.arrays import Floats
from zfcal.errors import InputError

FOV_RAD = math.radians(135.0)
"""Field of view to each side (Cazenille et al.; the authors' rig used 169 degrees)."""

KAPPA_0_MAX = 30.0
KAPPA_F_MAX = 30.0
ALPHA_MAX = 50.0

_KAPPA_LIMIT = 1000.0
"""A larger concentration is no behaviour (it spreads by less than 2 degrees) and no law
that a density on 360 angles can hold."""

SPEED_BINS = 10


@dataclass(frozen=True, slots=True, kw_only=True)
class ZoneParameters:
    """How an agent moves while it is in one zone.

    Parameters
    ----------
    name
        The zone's name in the arena.
    kappa_0
        Von Mises concentration of the base heading.
    kappa_f
        Von Mises concentration of the heading toward a neighbour.
    alpha
        Weight of the neighbours, per steradian of solid angle.
    kappa_w
        Concentration along the wall; None for ``kappa_0``.
    speed_frequency
        Ten bin frequencies on the arena's speed range, summing to one.
    gamma
        Attraction toward each zone of the arena, by its name, non-negative.
    """

    name: str
    kappa_0: float
    kappa_f: float
    alpha: float
    speed_frequency: tuple[float, ...]
    gamma: dict[str, float]
    kappa_w: float | None = None

    def __post_init__(self) -> None:
        where = f"Zone {self.name!r}"
        numbers = {"kappa_0": self.kappa_0, "kappa_f": self.kappa_f, "alpha": self.alpha}
        if self.kappa_w is not None:
            numbers["kappa_w"] = self.kappa_w
        numbers |= {f"gamma.{name}": value for name, value in self.gamma.items()}
        for key, value in numbers.items():
            if not 0 <= value < math.inf:
                raise InputError(f"{where}: {key} must be finite and not negative, got {value!r}.")
            if key.startswith("kappa") and value > _KAPPA_LIMIT:
                raise InputError(
                    f"{where}: {key} must be at most {_KAPPA_LIMIT:g}, got {value!r}.",
                    hint="It is a von Mises concentration; real fish have 1 to 30.",
                )
        _check_frequencies(where, self.speed_frequency)
        if not any(value > 0 for value in self.gamma.values()):
            raise InputError(f"{where}: gamma needs one positive value, got {self.gamma!r}.")


def _check_frequencies(where: str, frequency: tuple[float, ...]) -> None:
    if len(frequency) != SPEED_BINS:
        raise InputError(f"{where}: speed_frequency needs {SPEED_BINS} bins, got {len(frequency)}.")
    if not all(value >= 0 for value in frequency) or not 0.99 < sum(frequency) < 1.01:
        raise InputError(
            f"{where}: speed_frequency must be non-negative and sum to 1, got {frequency!r}.",
            hint="It is the zone's measured speed histogram, as frequencies.",
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Parameters:
    """A model: the zones' parameters and the effects that it has.

    Parameters
    ----------
    dt_s
        The step for which the parameters hold, in seconds.
    zones
        One per zone of the arena, in the arena's order.
    fov_rad
        Field of view to each side of the heading, in radians.
    base
        Name of the base model.
    effects
        For each effect of the model its parameters by name.
    """

    dt_s: float
    zones: tuple[ZoneParameters, ...]
    fov_rad: float = FOV_RAD
    base: str = "zoned-vision"
    effects: dict[str, dict[str, float]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if not 0 < self.dt_s < math.inf:
            raise InputError(f"Model dt_s must be a positive time in seconds, got {self.dt_s!r}.")
        if not 0 < self.fov_rad <= math.pi:
            raise InputError(
                f"Model fov_rad must be in (0, pi], got {self.fov_rad!r}.",
                hint="It is the angle to each side, in radians: 135 degrees are 2.356.",
            )

    @property
    def zone_names(self) -> tuple[str, ...]:
        """Names of the zones, in the arena's order."""
        return tuple(zone.name for zone in self.zones)

    def gamma_matrix(self) -> Floats:
        """Return the attraction from zone (row) to zone (column), shape (zone, zone)."""
        names = self.zone_names
        return np.array([[zone.gamma[name] for name in names] for zone in self.zones])


def n_genes(n_zones: int) -> int:
    """Return the number of genes: kappa_0, kappa_f, alpha and a row of gamma for each zone."""
    return n_zones * (3 + n_zones)


def gene_names(zone_names: tuple[str, ...]) -> tuple[str, ...]:
    """Return a name per gene, such as ``walls.kappa_0`` or ``walls.gamma.centre``."""
    own = ("kappa_0", "kappa_f", "alpha")
    return tuple(f"{zone}.{key}" for zone in zone_names for key in own) + tuple(
        f"{zone}.gamma.{to}" for zone in zone_names for to in zone_names
    )


def gene_scales(n_zones: int) -> Floats:
    """Return the value of each parameter at gene 1, shape (gene,)."""
    return np.concatenate(
        [np.tile([KAPPA_0_MAX, KAPPA_F_MAX, ALPHA_MAX], n_zones), np.ones(n_zones**2)]
    )


def to_genes(parameters: Parameters) -> Floats:
    """Return the genes in [0, 1] of a model, shape (gene,); beyond the bounds they are cut off.

    The order is that of `gene_names`: three per zone, then the rows of gamma.
    """
    own = [[zone.kappa_0, zone.kappa_f, zone.alpha] for zone in parameters.zones]
    values = np.concatenate([np.ravel(own), parameters.gamma_matrix().ravel()])
    return np.clip(values / gene_scales(len(parameters.zones)), 0.0, 1.0)


def from_genes(genes: ArrayLike, template: Parameters) -> Parameters:
    """Return ``template`` with the calibrated parameters taken from genes.

    Parameters
    ----------
    genes : array_like, shape (gene,)
        In [0, 1], in the order of `gene_names`. A row of gamma that is all zero
        prefers nothing and becomes a row of ones.
    template
        Gives the step, the field of view, the speeds and the effects.

    Raises
    ------
    InputError
        The genome is of another length, or a value is none of a model.
    """
    n_zones = len(template.zones)
    values = np.array(genes, dtype=np.float64)
    if values.shape != (n_genes(n_zones),):
        raise InputError(
            f"A genome of {n_zones} zones has {n_genes(n_zones)} genes, "
            f"got an array of shape {values.shape}."
        )
    values *= gene_scales(n_zones)
    own = values[: 3 * n_zones].reshape(n_zones, 3)
    gamma = values[3 * n_zones :].reshape(n_zones, n_zones)
    gamma[(gamma == 0).all(axis=1)] = 1.0
    zones = tuple(
        ZoneParameters(
            name=zone.name,
            kappa_0=float(own[z, 0]),
            kappa_f=float(own[z, 1]),
            alpha=float(own[z, 2]),
            kappa_w=zone.kappa_w,
            speed_frequency=zone.speed_frequency,
            gamma=dict(zip(template.zone_names, map(float, gamma[z]), strict=True)),
        )
        for z, zone in enumerate(template.zones)
    )
    return Parameters(
        dt_s=template.dt_s,
        zones=zones,
        fov_rad=template.fov_rad,
        base=template.base,
        effects=dict(template.effects),
    )


_PUBLISHED_SPEEDS = {
    "corridor": (
        0.0304615, 0.07993734, 0.10186769, 0.12054464, 0.14286059,
        0.15312688, 0.14098084, 0.10748283, 0.07632245, 0.04641523,
    ),
    "walls": (
        0.04810033, 0.13980081, 0.17786795, 0.17989672, 0.15912947,
        0.12113611, 0.08011804, 0.04758392, 0.02788639, 0.01848027,
    ),
    "centre": (
        0.02276516, 0.09278528, 0.16815177, 0.19097442, 0.18189135,
        0.13670595, 0.10106352, 0.05881, 0.03190572, 0.01494682,
    ),
}  # fmt: skip
PUBLISHED_SPEEDS = MappingProxyType(
    {
        name: tuple(value / math.fsum(row) for value in row)
        for name, row in _PUBLISHED_SPEEDS.items()
    }
)
"""Speed histograms of AB zebrafish in two rooms, bins of 0.02 m/s from 0 to 0.20 m/s."""

_NATURAL = {"corridor": (9.0, 8.0, 17.0), "walls": (9.0, 9.0, 42.0), "centre": (8.0, 20.0, 49.0)}
_NATURAL_GAMMA = {
    "corridor": (0.6, 0.9, 0.9),
    "walls": (0.6, 0.5, 0.4),
    "centre": (0.6, 0.8, 0.9),
}


def natural(zones: tuple[tuple[str, bool], ...], *, dt_s: float) -> Parameters:
    """Return parameters under which simulated fish change rooms as real ones do.

    In ``two-rooms`` a fish changes rooms about every 15 s and spends 8 % of its
    time in the corridor. Zones of other arenas take after ``walls`` where they
    follow walls and after ``centre`` where they do not, with no attraction
    between zones.

    Parameters
    ----------
    zones
        Name of each zone and whether it follows walls, in the arena's order.
    dt_s
        The step in seconds.
    """
    names = tuple(name for name, _ in zones)
    known = set(names) == set(_NATURAL)
    made = []
    for name, follows_walls in zones:
        like = name if name in _NATURAL else ("walls" if follows_walls else "centre")
        kappa_0, kappa_f, alpha = _NATURAL[like]
        row = dict(zip(_NATURAL, _NATURAL_GAMMA[name], strict=True)) if known else {}
        made.append(
            ZoneParameters(
                name=name,
                kappa_0=kappa_0,
                kappa_f=kappa_f,
                alpha=alpha,
                speed_frequency=PUBLISHED_SPEEDS[like],
                gamma={to: row.get(to, 1.0) for to in names},
            )
        )
    return Parameters(dt_s=dt_s, zones=tuple(made))
