"""The empty tank: learnt from frames or loaded, and what of a frame is not it.

Fish are darker than the tank, or lighter, which `learning` tells: only one sign counts
as foreground, so that the bright ghost left where a fish sat while the tank was learnt is
none. The mixture of Gaussians is OpenCV's (Zivkovic 2004); once frozen, what it calls
background is a range of greys per pixel, which is read off it by probing and costs a
two-hundredth of asking it again. Blobs are the business of others.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from zfcal.arrays import Bools, Floats32, Grey
from zfcal.cameras._kernels import median_ratio
from zfcal.cameras.frames import Image
from zfcal.errors import InputError
from zfcal.tracking.ghosts import without_step

LEARN_FRAMES = 100
LEARN_RATE = 0.05
"""The published values."""

DARK, LIGHT, EITHER = "dark", "light", "either"
POLARITIES = (DARK, LIGHT, EITHER)
"""What animals are, compared with the tank: darker, lighter, or one of both."""

_BLACK = 12
"""A frame whose brightest hundredth is darker than this grey shows nothing."""

_UNIFORM = 0.5
"""A frame whose greys spread less than this shows nothing either."""

_SAMPLES = 25
_SAT = 0.9
"""Quantile of a pixel's greys over time that is tank wherever fish sat for most of the time."""

_SIGMAS = 4.0
_LEAST_SD = 2.0
_PROBES = (32, 16, 8, 4, 2, 1)
"""Greys; the mixture's spread is limited, to nine greys."""
_GRID_PX = 16
_GRID = np.s_[_GRID_PX // 2 :: _GRID_PX, _GRID_PX // 2 :: _GRID_PX]

_BEYOND_PX = 3
"""The edge of a body at the border of a region: two pixels closed and dilated, and one over."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Background:
    """The empty tank as one camera sees it.

    Parameters
    ----------
    level : ndarray of uint8, shape (height, width)
        The grey of the empty tank.
    low, high : ndarray of uint8, shape (height, width)
        What is darker than ``low`` or lighter than ``high`` is not the tank.
    """

    level: Grey
    low: Grey
    high: Grey

    @property
    def size_px(self) -> tuple[int, int]:
        """Width and height."""
        return self.level.shape[1], self.level.shape[0]

    def inverted(self) -> Background:
        """Return the negative, in which light fish are dark."""
        return Background(
            level=~self.level,
            low=~self.high,
            high=~self.low,
        )

    def as_dark(self, polarity: str) -> Background:
        """Return the tank in which animals of a polarity are dark, see `as_dark`."""
        if polarity == LIGHT:
            return self.inverted()
        if polarity != EITHER:
            return self
        width = cv2.max(cv2.subtract(self.level, self.low), cv2.subtract(self.high, self.level))
        white = np.full_like(self.level, 255)
        low = cv2.subtract(white, width)
        return Background(level=white, low=np.asarray(low, np.uint8), high=white)

    def levelled(self, level: Grey, where: Bools) -> Background:
        """Return the tank with another level at some pixels, where it is as noisy as it was."""
        width = cv2.max(cv2.subtract(self.level, self.low), cv2.subtract(self.high, self.level))
        return Background(
            level=level,
            low=np.where(where, cv2.subtract(level, width), self.low),
            high=np.where(where, cv2.add(level, width), self.high),
        )

    def gain(self, grey: Grey) -> float:
        """Return how much brighter than the empty tank an image is; 1 for equally bright.

        The median ratio over a coarse grid: fish cover less than half of a tank.
        """
        return median_ratio(whole(grey), whole(self.level), _GRID_PX // 2, _GRID_PX)


def as_dark(grey: Grey, tank: Background, polarity: str) -> Grey:
    """Return an image in which animals of a polarity are darker than the tank.

    Its negative where they are lighter; where they are either, white less the difference.
    """
    if polarity == LIGHT:
        return ~grey
    if polarity == EITHER:
        difference: Grey = np.asarray(cv2.absdiff(grey, tank.level), np.uint8)
        return ~difference
    return grey


def whole(grey: Grey) -> Grey:
    """Return an image as kernels are compiled for: in one piece, and not read-only."""
    return grey if grey.flags.c_contiguous and grey.flags.writeable else grey.copy()


def grey_of(image: Image) -> Grey:
    """Return an image in grey, shape (height, width)."""
    if image.ndim == 2:
        return image
    if image.shape[2] == 1:
        return image[:, :, 0]
    return np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY), np.uint8)


def shows_nothing(grey: Grey) -> bool:
    """Tell whether an image is black or of one grey: a lens cap, a lost signal."""
    some = np.ascontiguousarray(grey[::8, ::8])
    lit = np.count_nonzero(some >= _BLACK)
    return bool(lit <= 0.01 * some.size or cv2.meanStdDev(some)[1][0, 0] < _UNIFORM)


class BackgroundLearner:
    """Learns the empty tank from the first frames, then freezes it.

    Frames that show nothing are left out. A mixture that forgets at the published rate takes
    a fish that rests for its last second for tank; where it is much darker than the tank was
    over the whole time, the whole time counts.

    Parameters
    ----------
    n_frames
        Frames to learn from.
    rate
        Weight of a new frame in the mixture.
    region : ndarray of bool, shape (height, width), optional
        Where the tank is asked for: there, and on the grid of `Background.gain`, each pixel is
        learnt as it would be without a region; elsewhere all greys are background.
    """

    def __init__(
        self,
        n_frames: int = LEARN_FRAMES,
        rate: float = LEARN_RATE,
        *,
        region: Bools | None = None,
    ) -> None:
        self.n_frames = n_frames
        self._where = None if region is None else _asked(region)
        self._rate = rate
        self._count = 0
        self._mixture = cv2.createBackgroundSubtractorMOG2(
            history=n_frames, varThreshold=_SIGMAS**2, detectShadows=False
        )
        # The most frequent grey alone: beside it the mixture would count a fish that rests.
        self._mixture.setBackgroundRatio(0.5)
        self.samples: list[Grey] = []
        self._probe: tuple[int, Background] | None = None

    @property
    def count(self) -> int:
        """Frames learnt from so far."""
        return self._count

    @property
    def is_ready(self) -> bool:
        """Whether as many frames have been seen as were asked for."""
        return self._count >= self.n_frames

    def add(self, grey: Grey) -> bool:
        """Learn from a frame; return whether it was of use.

        Raises
        ------
        InputError
            Its size differs from that of the frames before.
        """
        if shows_nothing(grey):
            return False
        if not self.fits(grey):
            raise InputError(
                f"The background is learnt from frames of {_size(self._known)} px, "
                f"got one of {_size(grey)} px."
            )
        self._mixture.apply(self._some(grey), None, self._rate if self._count else 1.0)
        if self._count % max(1, self.n_frames // _SAMPLES) == 0:
            self.samples.append(grey.copy())
        self._count += 1
        return True

    def freeze(self, polarity: str = DARK) -> Background:
        """Return what has been learnt.

        Parameters
        ----------
        polarity
            What fish are, compared with the tank: one of `POLARITIES`.

        Raises
        ------
        InputError
            No frame was of use.
        """
        if polarity == EITHER:
            return self.usual()
        light = polarity == LIGHT
        learnt = self._learnt()
        usual = _usual([self._some(sample) for sample in self.samples], light=light)
        return _without_sitters(
            learnt, self._spread(usual, learnt.level), light=light, where=self._where
        )

    def usual(self) -> Background:
        """Return the tank as it was for half of the time, whatever the polarity of fish.

        Raises
        ------
        InputError
            No frame was of use.
        """
        learnt = self._learnt()
        middle = len(self.samples) // 2
        stack = np.stack([self._some(sample) for sample in self.samples])
        level = self._spread(np.partition(stack, middle, axis=0)[middle], learnt.level)
        low = cv2.subtract(level, cv2.subtract(learnt.level, learnt.low))
        high = cv2.add(level, cv2.subtract(learnt.high, learnt.level))
        return Background(
            level=level, low=np.asarray(low, np.uint8), high=np.asarray(high, np.uint8)
        )

    def _learnt(self) -> Background:
        """Return what the mixture calls the tank."""
        if not self.samples:
            raise InputError(
                "No frame shows a tank to learn the background from.",
                hint="All were black or of one grey; give an image with --background.",
            )
        if self._probe is None or self._probe[0] != self._count:
            level = np.asarray(self._mixture.getBackgroundImage(), np.uint8)
            self._probe = self._count, self._whole(_probed(self._mixture, level))
        return self._probe[1]

    def fits(self, grey: Grey) -> bool:
        """Return whether a frame is as large as the region and the frames before."""
        shapes = [known.shape for known in (self._where, *self.samples[:1]) if known is not None]
        return all(shape == grey.shape for shape in shapes)

    @property
    def _known(self) -> NDArray[np.generic]:
        return self.samples[0] if self._where is None else self._where

    def _some(self, grey: Grey) -> Grey:
        """Return the pixels that are learnt, in one row where they are not all."""
        return grey if self._where is None else grey[self._where][None]

    def _spread(self, some: Grey, others: Grey) -> Grey:
        """Return an image of the pixels that are learnt, and of others elsewhere."""
        if self._where is None:
            return some
        whole = others.copy()
        whole[self._where] = some[0]
        return whole

    def _whole(self, some: Background) -> Background:
        tank = self.samples[0]
        return Background(
            level=self._spread(some.level, tank),
            low=self._spread(some.low, np.zeros_like(tank)),
            high=self._spread(some.high, np.full_like(tank, 255)),
        )


def _asked(region: Bools) -> Bools:
    """Return the pixels of a region, a few beyond, and those that tell how bright an image is."""
    square = np.ones((2 * _BEYOND_PX + 1,) * 2, np.uint8)
    asked = cv2.dilate(region.astype(np.uint8), square) > 0
    asked[_GRID] = True
    return asked


def background_of(image: Image, *, sd: float = _LEAST_SD) -> Background:
    """Return the background that an image of the empty tank is.

    Parameters
    ----------
    image
        Grey or colour.
    sd
        Noise of the camera, in greys.
    """
    level = grey_of(image)
    return _within(level, np.full(level.shape, max(sd, _LEAST_SD), np.float32))


def _within(level: Grey, sd: Floats32) -> Background:
    width = _SIGMAS * sd
    return Background(
        level=level.copy(),
        low=np.clip(level - width, 0, 255).astype(np.uint8),
        high=np.clip(level + width, 0, 255).astype(np.uint8),
    )


def _probed(mixture: cv2.BackgroundSubtractorMOG2, level: Grey) -> Background:
    """Return the range of greys about the level that a frozen mixture calls background."""
    limits = []
    known = mixture.apply(level, None, 0.0) == 0
    for sign in (-1, 1):
        reach = np.zeros(level.shape, np.int16)
        for step in _PROBES:
            # What it calls background hangs together: the range is halved.
            further = reach + step
            probe = np.clip(level + sign * further, 0, 255).astype(np.uint8)
            inside = known & (mixture.apply(probe, None, 0.0) == 0)
            reach[inside] = further[inside]
        limits.append(np.clip(level + sign * reach, 0, 255).astype(np.uint8))
    return Background(level=level, low=limits[0], high=limits[1])


def _usual(samples: list[Grey], *, light: bool) -> Grey:
    """Return what a pixel is wherever fish sat for less than most of the time."""
    share = 1 - _SAT if light else _SAT
    usual = np.quantile(np.stack(samples), share, axis=0, method="nearest")
    return np.asarray(usual, np.uint8)


def _without_sitters(
    learnt: Background, tank: Grey, *, light: bool, where: Bools | None = None
) -> Background:
    """Return the background with resting fish taken out, where they moved at some time."""
    usual = tank.astype(np.int16)
    away = (learnt.level - usual) if light else (usual - learnt.level)
    width = learnt.high.astype(np.int16) - learnt.low
    # Opened, so that a flickering edge, a pixel wide, stays what it was learnt as.
    square = np.ones((3, 3), np.uint8)
    apart = (away > width).astype(np.uint8)
    core = np.asarray(cv2.morphologyEx(apart, cv2.MORPH_OPEN, square), np.uint8)
    # Whole pieces that hold some of what is left, and their edges: tails are thin. Something
    # light that passed, such as a hand, is no tank that a fish hid.
    held = without_step(apart, tank, learnt.level, core=core, where=where).astype(np.uint8)
    sat = (cv2.dilate(held, square, iterations=2) > 0) & (away > 0)
    level = np.where(sat, usual, learnt.level)
    below = learnt.level.astype(np.int16) - learnt.low
    above = learnt.high.astype(np.int16) - learnt.level
    return Background(
        level=level.astype(np.uint8),
        low=np.clip(level - below, 0, 255).astype(np.uint8),
        high=np.clip(level + above, 0, 255).astype(np.uint8),
    )


def _size(grey: NDArray[np.generic]) -> str:
    return f"{grey.shape[1]} x {grey.shape[0]}"
