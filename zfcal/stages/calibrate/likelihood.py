"""The maximum-likelihood estimate of a window, from the tracks of its segments."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from zfcal.artifacts.lineage import JSON
from zfcal.artifacts.tables import read_tracks
from zfcal.behaviour.sampling import sample
from zfcal.errors import DamagedError, InputError
from zfcal.model.likelihood import Fit, fit
from zfcal.model.steps import steps_of
from zfcal.parameters import Parameters, to_genes
from zfcal.stages.events import LeftOut, Note, Tell
from zfcal.stages.opening import OpenTrial
from zfcal.stages.segments import STEP_S, readable, segment_path, segment_starts
from zfcal.tracks import FISH, concatenate

CERTAIN = 0.5
"""Positions of a lower confidence are guesses of the tracker and make no steps."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Estimate:
    """The most likely model of a window.

    Parameters
    ----------
    found
        The fit.
    """

    found: Fit

    @property
    def genes(self) -> NDArray[np.float64]:
        """The estimate as a population of one, shape (1, gene)."""
        return to_genes(self.found.parameters)[None, :]

    @property
    def table(self) -> dict[str, JSON]:
        """The estimate as the table ``[result.likelihood]`` of a model file."""
        values = _values(self.found.parameters)
        return {
            "nats_per_step": self.found.nats_per_step,
            "n_steps": self.found.n_steps,
            "lapse": dict(self.found.lapse),
            "parameters": {
                name: {
                    "value": values[name],
                    "low": low,
                    "high": high,
                    "identified": self.found.identified[name],
                }
                for name, (low, high) in self.found.interval.items()
            },
        }


def _values(parameters: Parameters) -> dict[str, float]:
    values: dict[str, float] = {}
    for zone in parameters.zones:
        values |= {
            f"{zone.name}.{key}": getattr(zone, key) for key in ("kappa_0", "kappa_f", "alpha")
        }
        values |= {f"{zone.name}.gamma.{to}": value for to, value in zone.gamma.items()}
    return values


def track_files(root: Path, span_s: tuple[int, int]) -> list[Path]:
    """Return the segments that a stretch of time touches and that are there."""
    start_s, end_s = span_s
    starts = [s for s in segment_starts(root) if start_s - STEP_S < s < end_s]
    return [segment_path(root, start) for start in starts]


def estimate(
    opened: OpenTrial, template: Parameters, span_s: tuple[int, int], tell: Tell
) -> Estimate | None:
    """Return the most likely parameters of the fish in a stretch of a trial.

    Parameters
    ----------
    opened
        The trial.
    template
        Gives the step, the field of view and the speeds.
    span_s
        From and to, in seconds since trial start.
    tell
        Hears why there is none.

    Returns
    -------
    Estimate or None
        None where the tracks are missing or damaged, the fish hardly move, or the
        model has effects, which the base model's likelihood does not know.
    """
    trial = opened.trial
    if template.effects:
        names = ", ".join(template.effects)
        tell(Note(text=f"{trial.root}: no likelihood estimate for a model with {names}."))
        return None
    files = track_files(trial.root, span_s)
    start_s, end_s = span_s
    where = f"{trial.root}, {start_s} s to {end_s} s"
    if not files:
        tell(Note(text=f"{where}: no tracks, so no likelihood estimate joins the search."))
        return None
    if len(readable(files, tell)) < len(files):
        return None
    try:
        tracks = concatenate([read_tracks(path) for path in files])
        tracks = tracks.take(~(tracks.confidence < CERTAIN))
        samples = sample(
            tracks, fps=trial.fps, dt_s=trial.dt_s, start_s=float(start_s), end_s=float(end_s)
        )
        steps = steps_of(samples, opened.arena, fov_rad=template.fov_rad)
        fish = samples.agent[samples.kind == FISH]
        found = fit(steps.take(np.isin(steps.agent, fish)), opened.arena, template)
    except DamagedError as error:
        problem = f"{where}: no likelihood estimate joins the search: {error}"
        tell(LeftOut(path=files[0].parent, problem=problem, hint=error.hint))
        return None
    except InputError as error:
        tell(Note(text=f"{where}: no likelihood estimate joins the search: {error}"))
        return None
    return Estimate(found=found) if math.isfinite(found.nats_per_step) else None
