"""Frames of a plain tank with tapering bodies, drawn at subpixel positions that are known.

Coverage is exact to a sixteenth of a pixel: bodies are drawn four times as large and averaged.
"""

import math

import cv2
import numpy as np

from zfcal.cameras.camera import Homography
from zfcal.cameras.frames import Frame

SIZE = 200
SCALE = 4
M_PER_PX = 0.002
FPS = 15.0

PROJECTION = Homography(
    size_px=(SIZE, SIZE),
    matrix=((M_PER_PX, 0.0, 0.0), (0.0, -M_PER_PX, SIZE * M_PER_PX), (0.0, 0.0, 1.0)),
)


def outline(length=24.0, width=7.0):
    """Return a body's outline about its centroid, head towards x, in pixels, (point, 2)."""
    along = np.linspace(0, 1, 40)
    # Round in front, tapering to the tail.
    half = width / 2 * np.sqrt(np.clip(along / 0.15, 0, 1)) * np.clip((1 - along) / 0.75, 0, 1)
    x = length * (0.5 - along)
    points = np.vstack([np.column_stack([x, half]), np.column_stack([x, -half])[::-1]])
    moments = cv2.moments((points * 64).astype(np.int32).reshape(-1, 1, 2))
    return points - np.array([moments["m10"], moments["m01"]]) / moments["m00"] / 64


def coverage(bodies, *, size=SIZE, shape=None):
    """Return the share of each pixel that bodies (x, y, heading) cover, (height, width).

    Headings turn clockwise, as angles of an image do.
    """
    fine = np.zeros((size * SCALE, size * SCALE), np.uint8)
    shape = outline() if shape is None else shape
    for x, y, heading in bodies:
        turn = np.array(
            [[math.cos(heading), -math.sin(heading)], [math.sin(heading), math.cos(heading)]]
        )
        # The origin is the centre of the top left pixel, here and in the larger image.
        at = (shape @ turn.T + (x, y) + 0.5) * SCALE - 0.5
        cv2.fillPoly(fine, [np.round(at * 16).astype(np.int32)], 255, shift=4)
    return cv2.resize(fine, (size, size), interpolation=cv2.INTER_AREA) / 255.0


def image(bodies, *, rng=None, noise=1.5, tank=180.0, fish=80.0, **how):
    """Return a grey image of bodies in a tank, with the camera's noise."""
    covered = coverage(bodies, **how)
    clean = tank + (fish - tank) * covered
    rng = rng or np.random.default_rng(0)
    return np.clip(np.rint(clean + rng.normal(0, noise, clean.shape)), 0, 255).astype(np.uint8)


def frames(paths, *, seed=0, **how):
    """Yield a frame per entry of paths, each a list of bodies (x, y, heading)."""
    rng = np.random.default_rng(seed)
    for number, bodies in enumerate(paths):
        yield Frame(number=number, time_s=number / FPS, image=image(bodies, rng=rng, **how))


def circling(n_frames, *, n=3, radius=60.0, turn=0.05):
    """Return bodies that follow each other round a circle, one list a frame."""
    start = 2 * math.pi * np.arange(n) / n
    return [
        [
            (
                SIZE / 2 + radius * math.cos(a + turn * k),
                SIZE / 2 + radius * math.sin(a + turn * k),
                a + turn * k + math.pi / 2,
            )
            for a in start
        ]
        for k in range(n_frames)
    ]
