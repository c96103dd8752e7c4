"""By which rule a trial publishes its models: as it did before, until it is told otherwise."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

from zfcal.artifacts.lineage import read_lineage
from zfcal.artifacts.reading.contents import numbered_of
from zfcal.artifacts.reading.places import is_regular
from zfcal.errors import DamagedError, InputError
from zfcal.stages.calibrate.searching import CalibrateOptions


def as_before(root: Path, options: CalibrateOptions) -> CalibrateOptions:
    """Return options that publish as the rounds that a trial has, if that is wanted.

    Raises
    ------
    InputError
        None of the trial's rounds can be read, or they publish an estimate, which is not made.
    """
    if not options.keeps_way:
        return options
    champion = _champion_of(root)
    if champion is None:
        champion = "forward" if options.settings.is_scored else "score"
    if champion == "likely" and not options.seed_likelihood:
        raise InputError(
            f"{root}: its rounds publish the likelihood estimate, which is not made.",
            hint="Say what to publish instead: --publish forward or --publish score.",
        )
    return replace(options, settings=replace(options.settings, champion=champion))


def _champion_of(root: Path) -> Any:
    """Return by what the first round that can be read publishes; None where there are no rounds.

    A model without a population is no round that another could go on from.
    """
    damaged: list[Path] = []
    for ending in (".toml", ".parquet"):
        for end, path in sorted(numbered_of(root / "models", ending).items()):
            if end == 0 or not is_regular(path):
                continue
            try:
                lineage = read_lineage(path)
            except (InputError, DamagedError):
                damaged += [path] if ending == ".parquet" else []
                continue
            if lineage.command == "calibrate":
                return lineage.options.get("champion", "score")
    if damaged:
        raise InputError(
            f"{damaged[0]}: cannot be read, nor can another round say what the trial publishes.",
            hint="Say it: --publish forward, score or likelihood.",
        )
    return None
