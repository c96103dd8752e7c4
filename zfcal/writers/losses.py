"""What a format has no place for, a sentence each."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from zfcal.arrays import Floats
from zfcal.tracks import GUESS
from zfcal.units import M_PER_MM
from zfcal.writers.dense import Dense


def lost(dense: Dense, holds: frozenset[str]) -> Iterator[str]:
    """Yield what is lost of these tracks; nothing for what they do not have.

    Parameters
    ----------
    dense
        The tracks.
    holds
        What the format holds, of ``headings``, ``confidence``, ``certainty`` (a confidence of
        one half or more), ``rate`` and ``times``.
    """
    seen = ~np.isnan(dense.xy_m[..., 0])
    n = int(seen.sum())
    n_headings = int(np.isfinite(dense.heading_rad).sum())
    if "headings" not in holds and n_headings:
        yield f"headings are lost: {n_headings} of {n} positions have one."
    if "confidence" not in holds:
        yield from _lost_confidence(dense.confidence[seen], has_certainty="certainty" in holds)
    if "rate" not in holds:
        yield f"the frame rate is lost, {dense.fps:g} Hz: say it where the file is opened."
    off_s = dense.time_off_s
    if off_s and not ("times" in holds and dense.times_tell_frames):
        yield (
            f"times are lost: they are up to {1000 * off_s:.3g} ms off frame / fps, which the "
            "file has in their place."
        )


def _lost_confidence(confidence: Floats, *, has_certainty: bool) -> Iterator[str]:
    n_guesses = int((confidence < GUESS).sum())
    n_below = int((confidence < 1).sum())
    if has_certainty and n_guesses:
        yield (
            f"the confidence of guesses is lost: {n_guesses} of {len(confidence)} positions are "
            "below 0.5 and have no certainty in the file; they stay guesses."
        )
    elif n_below and not has_certainty:
        yield (
            f"confidence is lost: {n_below} of {len(confidence)} positions are less than certain, "
            f"{n_guesses} of them guesses; in the file they look like certain ones."
        )


def lost_noise(noise_m: float | None) -> Iterator[str]:
    """Yield that the position noise is lost, where it is known; no format has it."""
    if noise_m is not None:
        yield f"the position noise is lost, {noise_m / M_PER_MM:.4g} mm: --noise-mm gives it back."


def noise_option(noise_m: float | None) -> tuple[str, ...]:
    """Return the option of the import that gives the position noise back."""
    return () if noise_m is None else ("--noise-mm", f"{noise_m / M_PER_MM:.15g}")
