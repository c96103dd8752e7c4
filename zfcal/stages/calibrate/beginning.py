"""Where all were at a window's beginning, from the tracks."""

from __future__ import annotations

import numpy as np

from zfcal.errors import InputError
from zfcal.model.start import Start, seen_at
from zfcal.sampling import sample_range
from zfcal.stages.events import say_nothing
from zfcal.stages.segments import STEP_S
from zfcal.stages.track_window import read_stretch
from zfcal.stages.trial_context import OpenTrial
from zfcal.stages.windows import LENGTH_S


def seen_first(opened: OpenTrial, end_s: int) -> Start | None:
    """Return where all were at a window's beginning; None where half of the fish were not seen.

    Parameters
    ----------
    opened
        The trial.
    end_s
        End of the window, in seconds since trial start.
    """
    trial, begin_s = opened.trial, end_s - LENGTH_S
    span_s = (max(0, begin_s - STEP_S), begin_s + STEP_S)
    try:
        samples = read_stretch(opened, span_s, say_nothing).samples
    except InputError:
        return None
    k, _ = sample_range(begin_s, end_s, dt_s=samples.dt_s)
    start = seen_at(samples, k, n_fish=trial.n_fish, n_robots=trial.n_robots)
    seen = np.isfinite(start.poses[: trial.n_fish, :2]).all(axis=1)
    return start if 2 * seen.sum() >= trial.n_fish else None
