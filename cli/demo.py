"""`zfcal demo`: a whole small trial from nothing, or a whole experiment."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from .closed_loop_options import closed_loop_options
from .options import NEW_PLACE, makes_artifacts, speaks
from .output import Output

if TYPE_CHECKING:
    from zfcal.stages.trial_context import Task


@click.command("demo")
@click.argument("folder", metavar="[DIR]", type=NEW_PLACE, default=Path("zfcal-demo"))
@closed_loop_options
@makes_artifacts
@speaks
def command(
    out: Output, folder: Path, *, loop: dict[str, Any] | None, dry_run: bool, force: bool
) -> None:
    r"""Simulate a tank and its cameras, track, analyse, calibrate, drive and report.

    DIR gets tank/ (the simulated truth and the images of it), trial/ (all that
    is made from these images) and a contact sheet of the worst frames. A virtual
    robot is driven by the calibrated model. Takes about a minute, and half a minute
    more where nothing was compiled before (zfcal --compile).

    With --closed-loop the fish react to a robot, which is driven by what is
    calibrated meanwhile: cameras, tracker, analysis, calibration, drive and a
    virtual FishBot at a serial port, in lock-step; with --real-time they are
    processes of their own, as on a rig. tank/ holds the truth.

    \b
    Example:
        zfcal demo
        zfcal demo --dry-run
        zfcal demo /tmp/demo --force
        zfcal demo loop --closed-loop --duration 10min
        zfcal demo baseline --closed-loop --no-video --swims random --seed 3
        zfcal demo on --closed-loop --fish-model fish.toml --model extended.toml
    """
    from zfcal.api.reporting import write_page
    from zfcal.stages.events import Planned
    from zfcal.stages.trial_context import Task
    from zfcal.virtual.demo import run_demo

    from .demo_closing import closing, takes

    task = Task(dry_run=dry_run, force=force)

    def work() -> None:
        if loop is not None:
            trial = _closed_loop(out, folder, loop, task)
        else:
            trial = run_demo(folder, out.tell, task=task)
        if dry_run:
            if not (trial / "report").exists():
                out.tell(Planned(path=trial / "report" / "index.html", reason="missing"))
            out.note(takes(loop))
            return
        write_page([trial], None, out.tell, task=task)
        out.note(f"Figures: {trial / 'report'} (open {trial / 'report' / 'index.html'})")
        for line in closing(folder, trial, is_loop=loop is not None):
            out.note(line)

    out.attempt(work)


def _closed_loop(out: Output, folder: Path, asked: dict[str, Any], task: Task) -> Path:
    from zfcal.api.rounds import CHAMPIONS, published_by
    from zfcal.units import M_PER_MM
    from zfcal.virtual.closed_loop import closed_loop
    from zfcal.virtual.fish import FishOptions
    from zfcal.virtual.trial import LOOP_SETTINGS, LoopOptions

    given = {name: value for name, value in asked.items() if value is not None}
    fish: dict[str, float] = {
        name: given[name]
        for name in ("wariness", "between_sd", "drift_sd", "drift_s")
        if name in given
    }
    if "noise_mm" in given:
        fish["noise_m"] = given["noise_mm"] * M_PER_MM
    loop: dict[str, Any] = {
        name: given[name]
        for name in ("duration_s", "robot", "seed", "model", "fish_model")
        if name in given
    }
    published = published_by(asked)
    if task.dry_run:
        from zfcal.virtual.demo_steps import tell_loop

        return tell_loop(folder, loop.get("duration_s", 600.0), out.tell, task=task)
    options = LoopOptions(
        **loop,
        video=not asked["no_video"],
        fish=FishOptions(**fish),
        settings=dataclasses.replace(
            LOOP_SETTINGS,
            **{name: given[name] for name in ("generations",) if name in given},
            **({} if published is None else {"champion": CHAMPIONS[published]}),
        ),
    )
    if asked["real_time"]:
        from zfcal.virtual.live_loop import live_loop

        return live_loop(folder, options, given.get("budget_s", 50.0), out.tell, task=task)
    return closed_loop(folder, options, out.tell, task=task)
