"""Single images as files: board images, a picture of the empty tank."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from zfcal.artifacts.reading.contents import read_bytes
from zfcal.artifacts.reading.pixels import check_pixels
from zfcal.errors import DamagedError


def read_image(path: Path) -> NDArray[np.uint8]:
    """Read an image file that OpenCV knows (PNG, JPEG, TIFF, BMP, ...).

    Returns
    -------
    ndarray of uint8, shape (height, width, 3)
        Blue, green, red, as it stands in the file: a camera's own turning is not undone.

    Raises
    ------
    InputError
        The file is missing or cannot be opened.
    DamagedError
        It is no image, or one that is cut.
    """
    data = read_bytes(path)
    flags = cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION
    check_pixels(path, data)
    try:
        image = cv2.imdecode(np.frombuffer(data, np.uint8), flags) if data else None
    except cv2.error:
        # Its own limit on sizes, for the forms whose head is not read here.
        image = None
    if image is None:
        raise DamagedError(
            f"{path}: is no image that can be read.",
            hint="Copy it again; PNG, JPEG, TIFF and BMP are read.",
        )
    return np.asarray(image, np.uint8)
