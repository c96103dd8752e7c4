"""From several body parts to the one position and the heading that tracks have.

SLEAP, DeepLabCut and movement all come here.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from zfcal.arrays import Floats, Ints
from zfcal.errors import InputError
from zfcal.readers.options import ImportOptions
from zfcal.readers.raw import Grid

_MEAN = "mean"


@dataclass(frozen=True, slots=True, kw_only=True)
class Poses:
    """Body parts of every agent in every frame.

    Parameters
    ----------
    position : ndarray of float64, shape (frame, agent, keypoint, 2)
        In `unit`; NaN where a part is missing.
    score : ndarray of float64, shape (frame, agent, keypoint), optional
        In [0, 1]; NaN where the source gives none, as for points set by hand.
    frame : ndarray of int64, shape (frame,)
    time_s : ndarray of float64, shape (frame,)
    agents, keypoints
        Their names.
    unit
        ``px`` or a unit of length.
    heading_rad : ndarray of float64, shape (frame, agent), optional
        From x towards y, in the file's axes; NaN where unknown.
    y_down
        Whether y is known to count downwards.
    notes
        A sentence each.
    """

    position: Floats
    score: Floats | None
    frame: Ints
    time_s: Floats
    agents: tuple[str, ...]
    keypoints: tuple[str, ...]
    unit: str = "px"
    heading_rad: Floats | None = None
    y_down: bool = True
    notes: tuple[str, ...] = ()


def choose(path: Path, poses: Poses, options: ImportOptions) -> Grid:
    """Return the asked-for body part as the position of each agent.

    Parameters
    ----------
    path
        Named in messages.
    poses
        All parts.
    options
        ``keypoint`` is needed when there are several parts; the mean of all is
        known only where each of them is, and as sure as the least sure one.
        ``body_axis`` gives the heading, from its first part to its second, in place of what
        the file may have.
    """
    xy, confidence = _position(path, poses, options.keypoint)
    heading_rad = poses.heading_rad
    if options.body_axis is not None:
        back, front = (_part(path, poses, name) for name in options.body_axis)
        along = poses.position[:, :, front] - poses.position[:, :, back]
        heading_rad = np.arctan2(along[..., 1], along[..., 0])
    return Grid(
        xy=xy,
        frame=poses.frame,
        time_s=poses.time_s,
        unit=poses.unit,
        heading_rad=heading_rad,
        confidence=None if confidence is None else np.clip(confidence, 0, 1),
        names=poses.agents,
        y_down=poses.y_down,
        notes=poses.notes,
    )


def _position(path: Path, poses: Poses, keypoint: str | None) -> tuple[Floats, Floats | None]:
    score = poses.score
    if keypoint is None and len(poses.keypoints) > 1:
        raise InputError(
            f"{path}: there are several body parts, expected one of them as the position: "
            f"{', '.join(poses.keypoints)}.",
            hint=f"Such as --keypoint {poses.keypoints[0]}, or --keypoint {_MEAN} "
            "(of all of them).",
        )
    if keypoint == _MEAN and _MEAN not in poses.keypoints:
        # A mean over the parts that happen to be seen would jump from frame to frame.
        return poses.position.mean(axis=2), None if score is None else score.min(axis=2)
    part = 0 if keypoint is None else _part(path, poses, keypoint)
    return poses.position[:, :, part], None if score is None else score[:, :, part]


def _part(path: Path, poses: Poses, name: str) -> int:
    if name not in poses.keypoints:
        raise InputError(
            f"{path}: no body part is called {name!r}, expected one of "
            f"{', '.join(poses.keypoints)}."
        )
    return poses.keypoints.index(name)
