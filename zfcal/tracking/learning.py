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

from zfcal.arrays import Bools, Floats, Grey
from zfcal.tracking.background import DARK, EITHER, LIGHT, Background
from zfcal.tracking.ghosts import Piece, pieces_of

_USUAL_MIN_BLOB_PX = 12.0
"""Smallest blob where nothing was learnt."""

_SHARE_OF_BODY = 0.15
"""Share of an animal's area below which a blob is none: in the older rig's images, 12 pixels."""

_LEAST_PX = 4.0
"""A blob that a body leaves in one pixel, blurred; less cannot be told from noise."""

_LEAST_CONTRAST = 8.0
"""Greys by which something stands out of the noise of a usual camera: four deviations of two."""

_THIN_PX = 45.0
"""Area of a body five times as long as wide, as zebrafish are from above, and three pixels wide."""

_TOLD = 0.9
"""Share of what stands out as an animal does that has to be of one sign."""

_MOST = 0.6
"""Share that is enough where all animals are of that sign: reflections are beside them."""

_ALIKE = 0.5, 4.0
"""Shares of a usual animal's mass between which something else stands out as an animal does."""

_KERNEL = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (3, 3))


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
        One of `zfcal.tracking.background.POLARITIES`; None where the film does not tell it.
    light_share
        Share of the pieces that stand out as an animal does that is lighter; NaN for nothing.
    area_px
        Pixels that differ from the tank where an animal is; NaN for nothing.
    least_px
        Pixels of the smallest piece that is usually there, as many as animals and one more, for a
        robot that nobody told of; NaN where that is not known.
    n_frames
        Frames that were looked at.
    """

    polarity: str | None = None
    light_share: float = float("nan")
    area_px: float = float("nan")
    least_px: float = float("nan")
    n_frames: int = 0

    @property
    def is_thin(self) -> bool:
        """Whether bodies are less than three pixels wide, so that opening would drop them."""
        return self.area_px < _THIN_PX

    @property
    def min_blob_px(self) -> float:
        """The smallest blob that may be an animal."""
        if not self.area_px > 0:
            return _USUAL_MIN_BLOB_PX
        smallest = max(_SHARE_OF_BODY * self.area_px, _LEAST_PX)
        if smallest > _USUAL_MIN_BLOB_PX and self.least_px > 0:
            # What is usually there is not dropped for being smaller than something large.
            return min(smallest, max(_SHARE_OF_BODY * self.least_px, _USUAL_MIN_BLOB_PX))
        return smallest


def learn(
    frames: Sequence[Grey],
    tank: Background,
    *,
    n_agents: int | None,
    region: Bools | None = None,
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
    found = [standing_out(frame, tank, region) for frame in frames]
    if not any(found):
        return Learnt(n_frames=len(frames))
    n = n_agents or _number(found)
    usual = _usual_mass(found, n)
    alike = [[each for each in frame if _is_alike(each, usual)] for frame in found]
    polarity, light_share = _polarity(alike, n)
    signs = {DARK: {-1}, LIGHT: {1}}.get(polarity or EITHER, {-1, 1})
    areas = [each.area_px for frame in alike for each in frame if each.sign in signs]
    return Learnt(
        polarity=polarity,
        light_share=light_share,
        area_px=float(np.median(areas)) if areas else float("nan"),
        least_px=_least_area(found, n, signs),
        n_frames=len(frames),
    )


def standing_out(frame: Grey, tank: Background, region: Bools | None = None) -> list[Standing]:
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
    x, y, width, height = boxes[:, :4].T
    # Of what the image cuts off it cannot be told how large it is.
    held &= (x > 0) & (y > 0) & (x + width < mask.shape[1]) & (y + height < mask.shape[0])
    areas = boxes[:, 4].astype(float)
    found = []
    for piece in pieces_of(np.asarray(labels, np.int32), np.asarray(boxes, np.int32), held):
        here, there = (_step(image, piece) for image in (frame, level))
        told = here if abs(here) >= abs(there) else there
        sign, area_px = 1 if told > 0 else -1, float(areas[piece.number])
        found.append(Standing(sign=sign, area_px=area_px, contrast=abs(told)))
    return found


def _step(image: Grey, piece: Piece) -> float:
    """Return by how many greys a piece of an image is lighter than what is around it."""
    part = image[piece.crop]
    return float(part[piece.inside].mean() - np.median(part[piece.around]))


def _ranked(values: Sequence[Sequence[float]], n: int) -> Floats:
    """Return the largest n of a frame, as they are in half of the frames; 0 for nothing.

    A hand is in some of the frames, and one of many pieces in those.
    """
    rows = [(sorted(frame, reverse=True) + [0.0] * n)[:n] for frame in values]
    return np.asarray(np.median(np.array(rows), axis=0), np.float64)


def _masses(found: Sequence[Sequence[Standing]], sign: int) -> list[list[float]]:
    return [[each.mass for each in frame if each.sign == sign] for frame in found]


def _number(found: Sequence[Sequence[Standing]]) -> int:
    """Return after how many pieces the next is smallest beside the one before."""
    most = max(map(len, found))
    ranked = _ranked([[each.mass for each in frame] for frame in found], most + 1)
    floor = _LEAST_PX * _LEAST_CONTRAST
    return 1 + int(np.argmax(ranked[:-1] / np.maximum(ranked[1:], floor)))


def _usual_mass(found: Sequence[Sequence[Standing]], n: int) -> float:
    """Return the mass of the middle one of n animals, the smaller where n is even.

    What is larger than animals are, such as a robot, is less than half of them, and so are those
    that are hidden; of two the robot is the larger.
    """
    dark, light = (_ranked(_masses(found, sign), n) for sign in (-1, 1))
    middle = n // 2
    for one, other in ((dark, light), (light, dark)):
        are_all_there = one[n - 1] >= _ALIKE[0] * one[middle] > 0
        if are_all_there and not other[n - 1] > 0 and other[middle] <= _ALIKE[1] * one[middle]:
            # Of the other sign there are fewer than animals: reflections.
            return float(one[middle])
    ranked = np.maximum(dark, light)[: middle + 1]
    some = ranked[ranked > 0]
    return float(some[-1]) if len(some) else 0.0


def _is_alike(each: Standing, usual: float) -> bool:
    return _ALIKE[0] * usual <= each.mass <= _ALIKE[1] * usual


def _polarity(alike: Sequence[Sequence[Standing]], n: int) -> tuple[str | None, float]:
    """Return the polarity, where it is told, and the share of pieces that are lighter.

    Pieces are counted, whatever their mass, n of a sign in a frame at most.
    """
    counts = np.array(
        [[min(n, sum(e.sign == sign for e in frame)) for sign in (-1, 1)] for frame in alike]
    )
    total = counts.sum(axis=0)
    if not total.any():
        return None, float("nan")
    share = total / total.sum()
    major = int(np.argmax(total))
    are_all_there = np.median(counts[:, major]) >= n
    polarity = None
    if share[major] >= _TOLD or (are_all_there and share[major] >= _MOST):
        polarity = (DARK, LIGHT)[major]
    elif np.mean((counts > 0).all(axis=1)) > _TOLD:
        polarity = EITHER
    return polarity, float(share[1])


def _least_area(found: Sequence[Sequence[Standing]], n: int, signs: set[int]) -> float:
    """Return the area of the smallest of n + 1 pieces that is a blob by the usual measure."""
    areas = [[each.area_px for each in frame if each.sign in signs] for frame in found]
    ranked = _ranked(areas, n + 1)
    blobs = ranked[ranked > _USUAL_MIN_BLOB_PX]
    return float(blobs[-1]) if len(blobs) else float("nan")
