"""The maximum-likelihood estimate of a window, from the tracks of its segments."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from zfcal.arrays import Floats
from zfcal.artifacts.lineage import JSON
from zfcal.errors import InputError
from zfcal.model.likelihood import Fit, fit
from zfcal.model.scene import make_scene
from zfcal.parameters import Parameters, to_genes
from zfcal.stages.events import Event, LeftOut, Note, Tell
from zfcal.stages.segments import segment_files
from zfcal.stages.track_window import read_stretch
from zfcal.stages.trial_context import OpenTrial


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
    def genes(self) -> Floats:
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
    where = f"{trial.root}, {span_s[0]} s to {span_s[1]} s"
    without = f"{where}: no likelihood estimate joins the search"
    if not segment_files(trial.root, span_s):
        tell(Note(text=f"{where}: no tracks, so no likelihood estimate joins the search."))
        return None

    def say(event: Event) -> None:
        if isinstance(event, LeftOut):
            event = replace(event, problem=f"{without}: {event.problem}")
        tell(event)

    try:
        stretch = read_stretch(opened, span_s, say)
        if stretch.n_left_out:
            return None
        found = fit(make_scene(stretch.samples, opened.arena), template)
    except InputError as error:
        tell(Note(text=f"{without}: {error}"))
        return None
    return Estimate(found=found) if math.isfinite(found.nats_per_step) else None
