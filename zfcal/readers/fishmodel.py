"""Tracks of FishModel, the older rig's simulator: its text output.

FishModel (``testModel.cpp``, ``model.cpp``): no header; a line for each step, the time, a tab, then
``x y direction`` of each agent, in metres and radians, with tabs between agents. Fish come first,
then robots; the program itself makes fish alone. The time is step / 15 whatever the time step is:
1/3 s unless ``-d`` says otherwise. y is the row in the image of the arena, a square of one metre:
it counts downwards. An agent that follows a trajectory which is over is written as ``0 0 0``.
"""

from __future__ import annotations

import re
from itertools import pairwise
from pathlib import Path

import numpy as np

from zfcal.arrays import Floats, Ints
from zfcal.errors import InputError
from zfcal.readers.assemble import Imported, assemble
from zfcal.readers.options import ImportOptions
from zfcal.readers.raw import Grid
from zfcal.readers.text import all_lines

_STEPS_PER_S = 15.0
"""Steps that the file counts as a second."""

_OFF = 0.1
"""By how much of a step a time may be rounded: six decimals now, six digits in older versions."""

_LAST = 2**31 - 1
"""The last step; four years of 15 a second."""

_NUMBER = r"[-+]?(?:\d+(?:\.\d*)?(?:[eE][-+]?\d+)?|nan)"
LINE = re.compile(rf"{_NUMBER}(?:\t{_NUMBER} {_NUMBER} {_NUMBER})+")
"""A line of the output."""


def read_fishmodel(path: Path, options: ImportOptions) -> Imported:
    """Read the output of FishModel, in metres.

    Parameters
    ----------
    path
        Text; ``.gz`` is unpacked.
    options
        A step takes 1 / ``fps`` seconds, since the file does not tell how long it was.
    """
    step, values = _parsed(path)
    ended = (values == 0).all(axis=-1)
    values[ended] = np.nan
    clock = (
        f"The file counts 15 steps as a second whatever they were: {options.fps:g} steps a second "
        "are taken, as --fps or trial.toml says (FishModel makes 3, unless -d says otherwise)."
    )
    notes = [clock]
    if ended.any():
        notes.append(f"{int(ended.sum())} positions at exactly 0 0 0 are taken as missing.")
    grid = Grid(
        xy=values[..., :2],
        frame=step,
        time_s=step / options.fps,
        unit="m",
        heading_rad=values[..., 2],
        notes=tuple(notes),
    )
    return assemble(path, grid.rows(), options)


def _parsed(path: Path) -> tuple[Ints, Floats]:
    """Return the steps and x, y and direction, shape (step, agent, 3)."""
    lines = all_lines(path)
    n_agents = lines[0][1].count("\t")
    for number, line in lines:
        if line.count("\t") != n_agents or not LINE.fullmatch(line):
            raise InputError(
                f"{path}, line {number}: expected a time and x, y and direction of "
                f"{n_agents or 'some'} agents, with tabs between agents, got {line[:60]!r}.",
                hint="The file may have been cut short.",
            )
    cells = np.array([line.replace("\t", " ").split(" ") for _, line in lines], dtype=np.float64)
    return _steps(path, lines, cells[:, 0]), cells[:, 1:].reshape(len(lines), n_agents, 3)


def _steps(path: Path, lines: list[tuple[int, str]], time_s: Floats) -> Ints:
    """Return the numbers of the steps."""
    exact = time_s * _STEPS_PER_S
    wrong = ~(np.abs(exact - np.rint(exact)) <= _OFF) | ~(exact > -_OFF)
    if wrong.any():
        number, line = lines[int(np.argmax(wrong))]
        raise InputError(
            f"{path}, line {number}: expected a time that is a whole number of 1/15 s, as "
            f"FishModel counts steps, got {line.partition(chr(9))[0]}."
        )
    late = ~(exact <= _LAST)
    if late.any():
        number, line = lines[int(np.argmax(late))]
        raise InputError(
            f"{path}, line {number}: expected a time of at most {_LAST / _STEPS_PER_S:.0f} s, got "
            f"{line.partition(chr(9))[0]}."
        )
    step = np.rint(exact).astype(np.int64)
    for (number, _), (before, after) in zip(lines[1:], pairwise(step.tolist()), strict=True):
        if not after > before:
            raise InputError(
                f"{path}, line {number}: expected a later step than {before}, got {after}.",
                hint="Two runs in one file: import them one by one.",
            )
    return step
