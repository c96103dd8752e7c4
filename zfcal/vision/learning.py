"""What the first images tell of the animals: darker or lighter than the tank, and how large.

TRex and FastTrack let a person say whether animals are darker or lighter than the tank, or
different from it (Walter and Couzin 2021, eLife 10:e64000; Gallois and Candelier 2021, PLoS
Comput. Biol. 17:e1008697); here the film says it. Whatever stands out from the empty tank is looked
at twice, in the frame and in the tank: an animal differs from what surrounds it in the frame,
the ghost that it left where it sat while the tank was learnt differs in the tank. So either
tells which sign animals have. What follows animals is the business of others.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from zfcal.vision.background import DARK, EITHER, LIGHT, Background, Grey

USUAL_MIN_BLOB_PX = 12.0
"""Smallest blob where nothing was learnt."""

_SHARE_OF_BODY = 0.15
"""Share of an animal's area below which a blob is none: in the older rig's images, 12 pixels."""

_LEAST_PX = 4.0
"""A blob that a body leaves in one pixel, blurred; less cannot be told from noise."""

_THIN_PX = 45.0
"""Area of a body five times as long as wide, as zebrafish are from above, and three pixels wide."""

_TOLD = 0.9
"""Share of what stands out that has to be of one sign."""

_COMPARABLE = 0.5
"""Share of a usual animal's mass from which on something else stands out as an animal does."""

_SURROUNDINGS_PX = 3
_KERNEL = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (3, 3))
_SQUARE = np.ones((3, 3), np.uint8)
_WIDE = np.ones((2 * _SURROUNDINGS_PX - 1,) * 2, np.uint8)


@dataclass(frozen=True, slots=True, kw_only=True)
class Standing:
    """Something that stands out from the empty tank in a frame.

    Parameters
    ----------
    sign
        1 if the animal that it speaks for is lighter than the tank, -1 if it is darker.
    area_px
        Pixels.
    contrast
        Greys by which it differs from its surroundings.
    """

    sign: int
    area_px: float
    contrast: float

    @property
    def mass(self) -> float:
        """Area times contrast, in greys and pixels."""
        return self.area_px * self.contrast


@dataclass(frozen=True, slots=True, kw_only=True)
class Learnt:
    """What a film tells of its animals.

    Parameters
    ----------
    polarity
        One of `zfcal.vision.background.POLARITIES`; None where the film does not tell it.
    light_share
        Share of what stands out, by area and squared contrast, that is lighter; NaN for nothing.
    area_px
        Pixels that differ from the tank where an animal is; NaN for nothing.
    n_frames
        Frames that were looked at.
    """

    polarity: str | None = None
    light_share: float = float("nan")
    area_px: float = float("nan")
    n_frames: int = 0

    @property
    def is_thin(self) -> bool:
        """Whether bodies are less than three pixels wide, so that opening would drop them."""
        return self.area_px < _THIN_PX

    @property
    def min_blob_px(self) -> float:
        """The smallest blob that may be an animal."""
        if not self.area_px > 0:
            return USUAL_MIN_BLOB_PX
        return max(_SHARE_OF_BODY * self.area_px, _LEAST_PX)


def learn(
    frames: Sequence[Grey],
    tank: Background,
    *,
    n_agents: int | None,
    region: NDArray[np.bool_] | None = None,
) -> Learnt:
    """Return what frames tell.

    Parameters
    ----------
    frames : sequence of ndarray of uint8, each of shape (height, width)
        Some of the first.
    tank
        Without animals, or nearly; nobody was taken out of it that sat.
    n_agents
        How many animals there are; None where that is not known.
    region : ndarray of bool, shape (height, width), optional
        Where animals can be.
    """
    found = [_heaviest(standing_out(frame, tank, region), n_agents) for frame in frames]
    all_found = [each for frame in found for each in frame]
    if not all_found:
        return Learnt(n_frames=len(frames))
    energy = np.array([each.area_px * each.contrast**2 for each in all_found])
    is_light = np.array([each.sign > 0 for each in all_found])
    light_share = float(energy[is_light].sum() / energy.sum())
    polarity = _polarity(found, light_share)
    of_it = [each for each in all_found if polarity in {None, EITHER} or _is(each, polarity)]
    return Learnt(
        polarity=polarity,
        light_share=light_share,
        area_px=_usual_area(of_it),
        n_frames=len(frames),
    )


def standing_out(
    frame: Grey, tank: Background, region: NDArray[np.bool_] | None = None
) -> list[Standing]:
    """Return what differs from the tank in a frame, and which sign of animal it speaks for."""
    gain = tank.gain(frame)
    if abs(gain - 1) > 0:
        frame = np.asarray(cv2.convertScaleAbs(frame, alpha=1 / gain), np.uint8)
    darker, lighter = (
        np.asarray(cv2.compare(frame, limit, how), np.uint8)
        for limit, how in ((tank.low, cv2.CMP_LT), (tank.high, cv2.CMP_GT))
    )
    if region is not None:
        darker[~region] = 0
        lighter[~region] = 0
    return [each for mask in (darker, lighter) for each in pieces(frame, tank.level, mask)]


def pieces(frame: Grey, level: Grey, mask: Grey) -> list[Standing]:
    """Return what hangs together in a mask, but for what the image cuts off.

    Parameters
    ----------
    frame, level : ndarray of uint8, shape (height, width)
        The image, and the empty tank.
    mask : ndarray of uint8, shape (height, width)
        Where they differ; what does not outlast opening by a 3 x 3 ellipse is noise.
    """
    opened = cv2.morphologyEx(mask, cv2.MORPH_OPEN, _KERNEL)
    closed = cv2.morphologyEx(mask, cv2.MORPH_CLOSE, _KERNEL)
    n, labels, boxes, _ = cv2.connectedComponentsWithStats(closed, connectivity=8)
    held = np.zeros(n, bool)
    held[labels[opened > 0]] = True
    found = []
    for k in np.flatnonzero(held[1:]) + 1:
        x, y, width, height, area = boxes[k]
        if x == 0 or y == 0 or x + width == mask.shape[1] or y + height == mask.shape[0]:
            # The image cuts it off: how large it is cannot be told.
            continue
        top, left = max(y - _SURROUNDINGS_PX, 0), max(x - _SURROUNDINGS_PX, 0)
        crop = np.s_[top : y + height + _SURROUNDINGS_PX, left : x + width + _SURROUNDINGS_PX]
        piece = labels[crop] == k
        near = cv2.dilate(piece.astype(np.uint8), _SQUARE) > 0
        around = (cv2.dilate(piece.astype(np.uint8), _WIDE) > 0) & ~near & (labels[crop] == 0)
        if around.any():
            here, there = (_step(image[crop], piece, around) for image in (frame, level))
            told = here if abs(here) >= abs(there) else there
            sign = 1 if told > 0 else -1
            found.append(Standing(sign=sign, area_px=float(area), contrast=abs(told)))
    return found


def _step(image: Grey, piece: NDArray[np.bool_], around: NDArray[np.bool_]) -> float:
    """Return by how many greys a piece of an image is lighter than what is around it."""
    return float(image[piece].mean() - np.median(image[around]))


def _heaviest(found: list[Standing], n_agents: int | None) -> list[Standing]:
    """Return as many as there are animals, or those that weigh a quarter of the heaviest."""
    found = sorted(found, key=lambda each: -each.mass)
    if n_agents is None:
        return [each for each in found if each.mass > 0.25 * found[0].mass]
    return found[:n_agents]


def _is(each: Standing, polarity: str) -> bool:
    return (each.sign > 0) == (polarity == LIGHT)


def _polarity(found: list[list[Standing]], light_share: float) -> str | None:
    """Return the polarity that nearly all speaks for; either where both are there throughout."""
    if light_share <= 1 - _TOLD:
        return DARK
    if light_share >= _TOLD:
        return LIGHT
    usual = float(np.median([each.mass for frame in found for each in frame]))
    both = [
        {each.sign for each in frame if each.mass >= _COMPARABLE * usual} == {-1, 1}
        for frame in found
    ]
    if np.mean(both) > _TOLD:
        return EITHER
    return None


def _usual_area(found: list[Standing]) -> float:
    """Return the area at which half of what stands out, by mass, is smaller."""
    found = sorted(found, key=lambda each: each.area_px)
    mass = np.cumsum([each.mass for each in found])
    return found[int(np.searchsorted(mass, mass[-1] / 2))].area_px
