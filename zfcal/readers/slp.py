"""Labels of SLEAP, ``.slp``, as sleap-io reads them.

Frames hold instances, each with a skeleton and, once animals were followed, a track. Instances that
a person set have precedence over those that were predicted, as in SLEAP itself. Where there are
tracks, what has none is nobody; without tracks there may be one animal: a person's instance then
stands for the prediction of its frame, also where the file does not say that it corrects it. Videos
are not opened.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from zfcal.arrays import Floats
from zfcal.errors import InputError
from zfcal.readers.clock import check_declared
from zfcal.readers.extras import alone, require, whole
from zfcal.readers.options import ImportOptions
from zfcal.readers.poses import Poses


def labelled(path: Path, options: ImportOptions) -> tuple[Poses, tuple[str, ...]]:
    """Return the body parts of all tracks, in pixels, and warnings.

    Parameters
    ----------
    path
        ``.slp``
    options
        Frames are played at ``fps``.

    Raises
    ------
    InputError
        sleap-io is not installed, the file is damaged, or it is not known who is who: several
        videos, several animals without tracks, or a track twice in a frame.
    """
    sleap_io = require("sleap_io", path, extra="sleap")
    alone(path, "SLEAP")
    with whole(path, "SLEAP"):
        labels = sleap_io.load_slp(str(path), open_videos=False)
        frames, rate_hz = _frames(path, labels)
    everybody = [found for some in frames.values() for found in some]
    used = {found.track for found in everybody}
    agents = [track for track in labels.tracks if track in used] or [None]
    nobody = sum(found.track not in agents for found in everybody)
    nodes = tuple(dict.fromkeys(name for i in everybody for name in i.skeleton.node_names))
    frame = np.array(sorted(frames), dtype=np.int64)
    cube = np.full((len(frame), len(agents), len(nodes), 3), np.nan)
    for row, number in enumerate(frame.tolist()):
        for agent, instance in _chosen(path, number, frames[number], agents).items():
            columns = [nodes.index(name) for name in instance.skeleton.node_names]
            cube[row, agents.index(agent), columns] = _points(instance)
    notes = _rate(path, rate_hz, options)
    if nobody:
        notes = (*notes, f"{nobody} instances without a track are left out.")
    poses = Poses(
        position=cube[..., :2],
        score=cube[..., 2],
        frame=frame,
        time_s=frame / options.fps,
        agents=tuple(agent.name for agent in agents if agent is not None),
        keypoints=nodes,
        notes=notes,
    )
    return poses, _replaced(frames, agents)


def _frames(path: Path, labels: Any) -> tuple[dict[int, list[Any]], Any]:
    """Return the instances by frame, of one video, and what the file has for its rate."""
    labelled_frames = [frame for frame in labels.labeled_frames if frame.instances]
    videos = {id(frame.video) for frame in labelled_frames}
    if len(videos) != 1:
        raise InputError(
            f"{path}: expected instances in frames of one video, got those of {len(videos)}.",
            hint="Save the labels of each video as a file of its own." if videos else "",
        )
    frames: dict[int, list[Any]] = {}
    for frame in labelled_frames:
        frames.setdefault(int(frame.frame_idx), []).extend(frame.instances)
    return frames, labelled_frames[0].video.fps


def _replaced(frames: Mapping[int, Sequence[Any]], agents: Sequence[Any]) -> tuple[str, ...]:
    """Tell of predictions without a track that gave way, unless a person corrected them."""
    n_frames = 0
    for some in frames.values():
        ours = [found for found in some if found.track is None and not _is_predicted(found)]
        theirs = [found for found in some if found.track is None and _is_predicted(found)]
        corrected = [found.from_predicted for found in ours]
        n_frames += bool(ours) and any(all(p is not c for c in corrected) for p in theirs)
    if not n_frames or agents != [None]:
        return ()
    warning = (
        f"In {n_frames} frames a person's instance stands for a prediction that the file does not "
        "say it corrects. If these are two animals, let SLEAP follow them first."
    )
    return (warning,)


def _chosen(
    path: Path, number: int, instances: Sequence[Any], agents: Sequence[Any]
) -> Mapping[Any, Any]:
    """Return the instance of each agent in a frame: a person's, else the predicted one."""
    chosen: dict[Any, Any] = {}
    for predicted in (True, False):
        some = [i for i in instances if _is_predicted(i) == predicted and i.track in agents]
        tracks = [found.track for found in some]
        twice = next((track for k, track in enumerate(tracks) if track in tracks[:k]), ...)
        if twice is None:
            raise InputError(
                f"{path}: frame {number} has {len(some)} instances and no track in the file shows "
                "which animal is which; expected a track for each animal.",
                hint="Let SLEAP follow the animals first.",
            )
        if twice is not ...:
            raise InputError(
                f"{path}: track {twice.name!r} is twice in frame {number}, expected once.",
                hint="Correct the tracks in SLEAP.",
            )
        chosen |= dict(zip(tracks, some, strict=True))
    return chosen


def _is_predicted(instance: Any) -> bool:
    return "score" in instance.points.dtype.names


def _points(instance: Any) -> Floats:
    """Return x, y and score of each node; NaN where it is not seen, and for a person's score."""
    points = np.full((len(instance.points), 3), np.nan)
    points[:, :2] = instance.numpy()
    if _is_predicted(instance):
        points[:, 2] = instance.points["score"]
    return points


def _rate(path: Path, stated: Any, options: ImportOptions) -> tuple[str, ...]:
    """Compare the rate of the video, where the file states one."""
    if stated is None or stated == 0:
        return ()
    if isinstance(stated, bool) or not isinstance(stated, int | float | np.number):
        return (f"The file states no usable frame rate ({stated!r}).",)
    return check_declared(path, float(stated), options.fps)
