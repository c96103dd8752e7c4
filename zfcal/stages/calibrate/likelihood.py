"""The maximum-likelihood estimate of a window, from the tracks of its segments."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from zfcal.arrays import Floats
from zfcal.artifacts.lineage import JSON
from zfcal.calibrate.rules import HALF_LIFE_S
from zfcal.diagnose.candidates import candidate_of
from zfcal.diagnose.screening import Screen
from zfcal.diagnose.speeds import fit_speed
from zfcal.errors import InputError
from zfcal.model.effects import find_effect
from zfcal.model.effects.genome import (
    genome_names,
    genome_ranges,
    settled,
    strengths_of,
    to_genome,
)
from zfcal.model.extended import bounds_of, maximise, with_effect
from zfcal.model.likelihood import IDENTIFIED, Fit, fit
from zfcal.model.scene import Moves, Scene, make_scene, thin
from zfcal.parameters import Parameters
from zfcal.stages.events import Event, LeftOut, Note, Tell, say_nothing
from zfcal.stages.segments import segment_files
from zfcal.stages.track_window import read_stretch
from zfcal.stages.trial_context import OpenTrial
from zfcal.stages.windows import LENGTH_S

_GOLDEN = (math.sqrt(5) - 1) / 2


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
        """The estimate as a population of one, shape (1, gene), see `settled`."""
        return settled(to_genome(self.found.parameters))[None, :]

    @property
    def table(self) -> dict[str, JSON]:
        """The estimate as the table ``[result.likelihood]`` of a model file."""
        low, high = genome_ranges(self.found.parameters)
        found = (low + self.genes[0] * (high - low)).tolist()
        values = dict(zip(genome_names(self.found.parameters), found, strict=True))
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
        None where the tracks are missing or damaged, or the fish hardly move.
    """
    trial = opened.trial
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
        scene = make_scene(stretch.samples, opened.arena)
        found = _with_speeds(scene, fit(scene, template))
    except InputError as error:
        tell(Note(text=f"{without}: {error}"))
        return None
    return Estimate(found=found) if math.isfinite(found.nats_per_step) else None


def remembered(
    opened: OpenTrial, template: Parameters, end_s: int, span_s: tuple[int, int]
) -> Floats | None:
    """Return the estimate over all minutes so far, older ones counting less, as a genome.

    Parameters
    ----------
    opened
        The trial.
    template
        Gives the step, the field of view and the speeds.
    end_s
        End of the window, all of which counts.
    span_s
        What is looked at, see `memory_span`.

    Returns
    -------
    ndarray, shape (gene,), or None
        None where the tracks do not suffice; whose are damaged are left out.
    """
    try:
        scene = make_scene(read_stretch(opened, span_s, say_nothing).samples, opened.arena)
        faded = _faded(scene, end_s - LENGTH_S)
        found = _with_speeds(faded, fit(faded, template, level=None))
    except InputError:
        return None
    return settled(to_genome(found.parameters)) if math.isfinite(found.nats_per_step) else None


def memory_span(end_s: int) -> tuple[int, int]:
    """Return what the estimate over all minutes so far looks at: beyond, a step counts 1/8."""
    return max(0, end_s - LENGTH_S - round(3 * HALF_LIFE_S)), end_s


def _faded(scene: Scene, until_s: float) -> Scene:
    """Return a scene with the fewer steps the older they are, half as many per half-life.

    Which are left out is spread evenly, by multiples of the golden ratio.
    """

    def kept(steps: Moves) -> NDArray[np.bool_]:
        age_s = np.maximum(until_s - scene.time_s(steps), 0.0)
        spread = np.modf(np.arange(len(age_s)) * _GOLDEN)[0]
        return np.asarray(spread < np.exp2(-age_s / HALF_LIFE_S))

    return thin(scene, kept(scene.turns), kept(scene.moves))


def _with_speeds(scene: Scene, found: Fit) -> Fit:
    """Return a fit whose effects on speed have their most likely strengths, one after the other."""
    for name, key in strengths_of(found.parameters):
        if not find_effect(name).on_speed:
            continue
        model, values = found.parameters, found.parameters.effects[name]
        others = {other: given for other, given in model.effects.items() if other != name}
        without = maximise(scene, replace(model, effects=others), rounds=0)
        candidate = candidate_of(name, values)
        speed = fit_speed(Screen(scene=scene, fitted=without), candidate, values[key])
        low, high = bounds_of(name, key)
        pair, (least, most) = f"{name}.{key}", speed.interval
        found = replace(
            found,
            parameters=with_effect(model, name, {key: speed.values[key]}),
            interval=found.interval | {pair: speed.interval},
            identified=found.identified | {pair: most - least < IDENTIFIED * (high - low)},
        )
    return found
