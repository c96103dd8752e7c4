"""The three models of an extension, from the same minutes with the same budget and luck."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from zfcal.artifacts.lineage import JSON
from zfcal.behaviour.ceilings import Ceiling, summarise
from zfcal.behaviour.scores import population_scores
from zfcal.behaviour.statistics import Statistics
from zfcal.calibrate.confirm import confirm
from zfcal.calibrate.group import Purpose, SeedSource, runs_of, with_measured_speeds
from zfcal.calibrate.objective import Objective
from zfcal.calibrate.rounds import RoundResult
from zfcal.calibrate.task import Settings
from zfcal.calibrate.task import Task as RoundTask
from zfcal.diagnose.candidates import company_of
from zfcal.diagnose.findings import Gap
from zfcal.diagnose.heldout import (
    Effects,
    Gains,
    Steps,
    effect_steps,
    evaluate,
    fit_base,
    fit_effects,
    heading_gains,
    own_speeds,
    speed_gains,
)
from zfcal.diagnose.placebo import placebo_for
from zfcal.diagnose.screening import Screen
from zfcal.model.effects import find_effect
from zfcal.model.effects.genome import settled
from zfcal.model.simulate import Counts
from zfcal.parameters import Parameters, to_genes
from zfcal.stages.calibrate.result import result_table, score_table
from zfcal.stages.calibrate.searching import CalibrateOptions, run_search
from zfcal.stages.diagnose.diagnose import Case
from zfcal.stages.events import Progress, Tell
from zfcal.stages.extend.extended_group import SpanGroup
from zfcal.stages.extend.gap import Judged, draw_blocks, effect_gap, feature_gaps, likelihood_gap
from zfcal.stages.extend.halves import Halves, split
from zfcal.stages.track_window import Stretch

WITHOUT, WITH, PLACEBO = "without", "with", "placebo"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Extended:
    """What an extension made.

    Parameters
    ----------
    model
        With the effects, calibrated.
    result
        The table ``[result]`` of its file.
    gap
        Before and after.
    """

    model: Parameters
    result: dict[str, JSON]
    gap: list[Gap]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Calibrated:
    """One of the three models: its calibration, and what it scores on held-out minutes."""

    result: RoundResult
    judged: Judged


@dataclass(frozen=True, kw_only=True, eq=False)
class Extension:
    """Effects to be added to a model.

    Parameters
    ----------
    case, stretch
        Trial, model and tracks.
    effects
        With the parameters to start from, in the order of adding.
    placebo
        A wrong effect instead; None where there is none.
    halves
        The minutes to learn from and to judge on.
    calibration
        Budget, seed and workers of each calibration.
    tell
        Hears how far it is.
    """

    case: Case
    stretch: Stretch
    effects: Effects
    placebo: str | None
    halves: Halves
    calibration: CalibrateOptions
    tell: Tell

    @property
    def seed(self) -> int:
        """Of all random numbers."""
        asked = self.calibration.seed
        return self.case.opened.trial.seed if asked is None else asked

    @property
    def _names(self) -> tuple[str, ...]:
        return (WITHOUT, WITH) if self.placebo is None else (WITHOUT, WITH, PLACEBO)

    def checkpoints(self, start: Path) -> list[Path]:
        """Return where the three searches keep theirs; ``start`` begins the names."""
        return [start.with_name(f"{start.name}-{name}.checkpoint") for name in self._names]

    @cached_property
    def fits(self) -> dict[str, Screen]:
        """The models at their maximum likelihood on the minutes to learn from."""
        base = fit_base(self.halves.training, self.case.parameters)
        made = {WITHOUT: base, WITH: fit_effects(base, self.effects)}
        if self.placebo is not None:
            made[PLACEBO] = fit_effects(base, {self.placebo: {}})
        return made

    def make(self, checkpoints: Path, *, key: str) -> Extended:
        """Fit, calibrate and judge the models.

        Parameters
        ----------
        checkpoints
            How the searches' checkpoints begin.
        key
            What these must agree in to be of use.
        """
        places = self.checkpoints(checkpoints)
        done: dict[str, _Calibrated] = {}
        for number, (name, place) in enumerate(zip(self._names, places, strict=True)):
            self.tell(Progress(stage="models", done=number, total=len(places)))
            done[name] = self._calibrate(name, place, f"{key} {name}")
        self.tell(Progress(stage="models", done=len(places), total=len(places)))
        ours = done[WITH]
        result: dict[str, JSON] = {**result_table(ours.result, {})}
        result["held_out"] = {
            name: score_table(each.judged.scores, each.judged.ceiling)
            for name, each in done.items()
        }
        result["placebo"] = self.placebo
        return Extended(model=ours.result.champion, result=result, gap=self._gap(done))

    def _calibrate(self, name: str, checkpoint: Path, key: str) -> _Calibrated:
        halves, opened = self.halves, self.case.opened
        screen, control = self.fits[name], halves.pooled(halves.learnt)
        task = RoundTask(
            group=SpanGroup(
                arena=opened.arena,
                template=self._template(screen),
                n_fish=opened.trial.n_fish,
                n_robots=opened.trial.n_robots,
                span_s=self._span_s,
                n_workers=self.calibration.workers,
            ),
            control=control,
            guests=settled(to_genes(screen.fitted.parameters))[None, :],
            moves_effects=False,
            seeds=SeedSource(trial_seed=self.seed, window_end_s=int(self._span_s[1])),
        )
        settings = replace(self.calibration.settings, window_s=halves.seconds(halves.learnt))
        options = replace(self.calibration, settings=settings)
        result = run_search(task, options, checkpoint, self.tell, key=key)
        return _Calibrated(result=result, judged=self._judge(task, result, settings))

    @property
    def _span_s(self) -> tuple[float, float]:
        scene = self.halves.scene
        start_s = float(scene.k[0]) * scene.dt_s
        return start_s, start_s + scene.duration_s

    def _template(self, screen: Screen) -> Parameters:
        """Return the model that genes complete: its effects as fitted, and its own speeds."""
        model = replace(self.case.parameters, effects=screen.fitted.parameters.effects)
        if any(find_effect(name).on_speed for name in model.effects):
            return own_speeds(screen, model, self.case.opened.arena.bins.speed_m_s)
        control = self.halves.pooled(self.halves.learnt)
        return with_measured_speeds(model, control)

    def _judge(self, task: RoundTask, result: RoundResult, settings: Settings) -> Judged:
        """Simulate a champion with new seeds, and hold it against the minutes held out."""
        judge = Objective(
            group=task.simulator,
            control=self.halves.pooled(self.halves.held_out),
            n_steps=task.steps_of(settings.long_s),
            seeds=task.seeds.seeds(Purpose.CONFIRMATION, settings.long_runs),
        )
        confirmed = confirm(judge, result.genes[None, :])
        ceiling = self._ceiling(task, result, confirmed.long_run, settings.n_windows)
        return Judged(scores=confirmed.scores, long_run=confirmed.long_run, ceiling=ceiling)

    def _ceiling(
        self, task: RoundTask, result: RoundResult, long_run: Statistics, n_windows: int
    ) -> Ceiling:
        """Return what a champion reaches against itself on as many minutes as were held out.

        Minutes that lie a minute apart hardly know each other: each is a run of its own,
        and a window is as many of them together.
        """
        group, held_out = task.simulator, self.halves.held_out
        n_blocks = int(held_out.sum())
        counts = runs_of(
            group.simulate(
                result.genes[None, :],
                n_counted=group.n_fish or group.n_agents,
                n_steps=task.steps_of(self.halves.seconds(held_out) / n_blocks),
                seeds=task.seeds.seeds(Purpose.CEILING, n_windows * n_blocks),
            ),
            0,
        )
        windows = Counts(
            *(part.reshape(n_windows, n_blocks, *part.shape[1:]).sum(axis=1) for part in counts)
        )
        return summarise(population_scores(windows, long_run).each(long_run.zone_names))

    def _gap(self, done: dict[str, _Calibrated]) -> list[Gap]:
        halves = self.halves
        draws = draw_blocks(halves, np.random.default_rng([self.seed, 41]))
        there = {name: evaluate(each, halves.judging) for name, each in self.fits.items()}
        likelihood = likelihood_gap(
            halves,
            draws,
            self._gains(there, WITH),
            self._gains(there, PLACEBO) if self.placebo else [],
        )
        placebo = done[PLACEBO].judged if self.placebo else None
        features = feature_gaps(halves, draws, (done[WITHOUT].judged, done[WITH].judged, placebo))
        before, after, wrong = (self._statistic(there, n) for n in (WITHOUT, WITH, PLACEBO))
        made = [likelihood, *features]
        if before is not None and after is not None:
            made.append(effect_gap(halves, draws, (before, after, wrong)))
        return made

    def _gains(self, there: dict[str, Screen], name: str) -> list[Gains]:
        model, base = there[name], there[WITHOUT]
        random = np.random.default_rng([self.seed, 43])
        speeds = speed_gains(model, base, self.fits[name], random=random)
        headings = heading_gains(model, base)
        return [headings] if speeds is None else [headings, speeds]

    def _statistic(self, there: dict[str, Screen], name: str) -> Steps | None:
        """Return the first effect's own statistic in a model; None for what is none of steps."""
        first = next(iter(self.effects))
        if name not in there or not find_effect(first).has_steps:
            return None
        values = self.fits[WITH].fitted.parameters.effects[first]
        return effect_steps(there[name], self.fits[name], first, values)


def extension_of(
    case: Case,
    stretch: Stretch,
    effects: Effects,
    how: tuple[CalibrateOptions, Sequence[str], Tell],
) -> Extension:
    """Return the extension of a model by effects; nothing is fitted yet.

    Parameters
    ----------
    case, stretch
        Trial, model and tracks.
    effects
        With the parameters to start from.
    how
        How to calibrate; effects that cannot be told from these, which are no placebo; and
        who hears how far it is.

    Raises
    ------
    InputError
        The recording is too short to hold anything out.
    """
    calibration, ties, tell = how
    halves = split(case.opened, stretch)
    first = next(iter(effects))
    wrong = placebo_for(
        first,
        company_of(halves.scene),
        without=[*effects, *ties, *case.parameters.effects],
    )
    return Extension(
        case=case,
        stretch=stretch,
        effects=effects,
        placebo=None if wrong is None else wrong.name,
        halves=halves,
        calibration=calibration,
        tell=tell,
    )
