"""Compiled kernels and the same code without the compiler give the same run."""

from __future__ import annotations

import json
import os
import subprocess
import sys

import numpy as np
import pytest

from zfcal.model.kernels.run import record_run
from zfcal.model.simulate import individuals, pack
from zfcal.model.tank import make_tank

_PLAIN = """
import json, sys, warnings
from pathlib import Path
import numpy as np
warnings.simplefilter("ignore", RuntimeWarning)  # words of 64 bits are meant to overflow
from zfcal.artifacts.arenas import load_arena
from zfcal.model.tank import make_tank
from zfcal.model.kernels.run import record_run
from zfcal.model.simulate import individuals, pack
from zfcal.parameters import natural
arena = load_arena("two-rooms", Path())
model = natural(tuple((z.name, z.follows_walls) for z in arena.zones), dt_s=0.2)
record = record_run(
    np.uint64(9), individuals(3, 0), 0, 25, pack([model], arena), make_tank(arena, cells=20),
    int(sys.argv[1]),
)
json.dump(record.tolist(), sys.stdout)
"""


@pytest.mark.slow
@pytest.mark.parametrize("grid", [0, 90], ids=["exact", "grid"])
def test_compiled_and_plain_runs_are_the_same(grid, two_rooms, model):
    """Three agents, 24 steps, either sampler: positions to a nanometre.

    The plain run is a process of its own in which the compiler is off.
    """
    done = subprocess.run(
        [sys.executable, "-c", _PLAIN, str(grid)],
        env={**os.environ, "NUMBA_DISABLE_JIT": "1"},
        capture_output=True,
        text=True,
        check=True,
    )

    compiled = record_run(
        np.uint64(9), individuals(3, 0), 0, 25, pack([model], two_rooms),
        make_tank(two_rooms, cells=20), grid,
    )  # fmt: skip

    assert np.array(json.loads(done.stdout)) == pytest.approx(compiled, abs=1e-9)
