"""Names of arrays by what they hold; their shapes stand in the docstrings of whoever takes them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Floats32 = NDArray[np.float32]
Ints = NDArray[np.int64]
Indices = NDArray[np.intp]
Bools = NDArray[np.bool_]
Seeds = NDArray[np.uint64]
Grey = NDArray[np.uint8]
"""Shades of an image with one channel."""
