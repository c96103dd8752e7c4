"""One agent's next move as a kernel of its own, for those who move few agents at a time.

Simulations make it a part of their step, which is quicker and takes long to compile.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from zfcal.arrays import Floats
from zfcal.model.kernels.compiled import kernel
from zfcal.model.kernels.geometry import Tank
from zfcal.model.kernels.heading import draw_move
from zfcal.model.kernels.perception import Sight
from zfcal.model.kernels.state import Packed, Work


@kernel
def draw_one(
    i: int, state: Floats, packed: Packed, tank: Tank, sight: Sight,
    random: NDArray[np.uint64], work: Work,
) -> None:  # fmt: skip
    """Write an agent's next move by the first model and the exact sampler; see `draw_move`."""
    draw_move(i, state, 0, packed, tank, sight, random, work, False)
