"""The axes and the unit in which another program's file has its positions.

zfcal has metres and y up. Most programs have pixels of an image, with y down.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from zfcal.arrays import Floats
from zfcal.errors import InputError
from zfcal.units import M_PER_CM, M_PER_MM

DEFAULT_M_PER_PX = M_PER_MM
"""Scale of a file in pixels where nothing is known of an image: a pixel is a millimetre."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Image:
    """How the tank lies in an image.

    Parameters
    ----------
    m_per_px
        Metres per pixel; None where only other units are known of it.
    origin_m
        Where the tank's (0, 0) lies, from the upper left corner of the image: to the right
        and down, in metres (to the right and up where `y_down` is false).
    y_down
        Whether the image counts y downwards.
    """

    m_per_px: float | None = None
    origin_m: tuple[float, float]
    y_down: bool = True

    def axes(self, unit: str) -> Axes:
        """Return the image's axes in ``px`` or ``cm``."""
        m_per_unit = M_PER_CM if unit == "cm" else self.m_per_px or DEFAULT_M_PER_PX
        x_m, y_m = self.origin_m
        origin = (x_m / m_per_unit, y_m / m_per_unit)
        return Axes(unit=unit, m_per_unit=m_per_unit, origin=origin, y_down=self.y_down)


@dataclass(frozen=True, slots=True, kw_only=True)
class Axes:
    """Unit and axes of a file.

    Parameters
    ----------
    unit
        ``m``, ``cm`` or ``px``.
    m_per_unit
        Metres per unit.
    origin
        Where the tank's (0, 0) lies, in the file's unit and axes.
    y_down
        Whether y counts downwards.
    """

    unit: str
    m_per_unit: float
    origin: tuple[float, float] = (0.0, 0.0)
    y_down: bool = False

    def __post_init__(self) -> None:
        if not 0 < self.m_per_unit < math.inf:
            raise InputError(
                f"A scale must be a positive number of metres, got {self.m_per_unit!r}.",
                hint="Such as --mm-per-px 0.98",
            )

    def place(self, xy_m: Floats) -> Floats:
        """Return positions in the file's unit and axes.

        Parameters
        ----------
        xy_m : ndarray, shape (..., 2)
            In metres, y up; NaN stays NaN.
        """
        xy = xy_m / self.m_per_unit
        if self.y_down:
            xy[..., 1] *= -1.0
        return xy + self.origin

    def as_options(self) -> tuple[str, ...]:
        """Return the options by which `zfcal import` finds the tank's metres again."""
        scale = ("--mm-per-px", _number(self.m_per_unit / M_PER_MM)) if self.unit == "px" else ()
        x, y = self.origin
        is_moved = self.y_down or (x, y) != (0, 0)
        moved = ("--origin", f"{_number(x)},{_number(y)}") if is_moved else ()
        return (*scale, *moved, *(("--flip-y",) if self.y_down else ()))


METRES = Axes(unit="m", m_per_unit=1.0)
"""The tank's own axes."""


def image_of_import(options: Mapping[str, object]) -> Image | None:
    """Return the image in which imported tracks were, from the options of their import.

    Parameters
    ----------
    options
        As the lineage of tracks states them.

    Returns
    -------
    Image or None
        None where the file was not in pixels, nor in the centimetres of TRex.
    """
    m_per_px = options.get("m_per_px")
    m_per_unit = m_per_px if isinstance(m_per_px, int | float) else None
    if m_per_unit is None and options.get("format") == "trex":
        m_per_unit = M_PER_CM
    if m_per_unit is None:
        return None
    origin = options.get("origin")
    x, y = origin if isinstance(origin, list | tuple) else (0.0, 0.0)
    return Image(
        m_per_px=None if m_per_px is None else float(m_per_unit),
        origin_m=(float(x) * m_per_unit, float(y) * m_per_unit),
        y_down=bool(options.get("flip_y")),
    )


def _number(value: float) -> str:
    # Fifteen digits, and no more: 0.98 stays 0.98 when it was divided and multiplied.
    return f"{value + 0.0:.15g}"
