"""What a viewer of MCAP files is told of a camera."""

from __future__ import annotations

import itertools

from zfcal.artifacts.frame_files import Calibration
from zfcal.cameras.camera import FISHEYE, Camera, Homography

_PLUMB_BOB, _RATIONAL = 5, 8


def calibration_of(camera: Camera | Homography | None) -> Calibration | None:
    """Return a camera's calibration in the viewers' words.

    Returns
    -------
    Calibration or None
        None for a camera that they have no word for: a homography, or a lens of
        12 or 14 coefficients of which the last ones are not zero.
    """
    if not isinstance(camera, Camera):
        return None
    matrix = tuple(float(value) for value in itertools.chain.from_iterable(camera.matrix))
    said = list(camera.distortion)
    if camera.model == FISHEYE:
        model = "kannala_brandt"
    elif len(said) <= _PLUMB_BOB:
        model, said = "plumb_bob", said + [0.0] * (_PLUMB_BOB - len(said))
    elif not any(said[_RATIONAL:]):
        model, said = "rational_polynomial", said[:_RATIONAL]
    else:
        return None
    return Calibration(
        size_px=camera.size_px,
        distortion_model=model,
        distortion=tuple(map(float, said)),
        matrix=matrix,
    )
