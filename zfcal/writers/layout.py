"""A layout of Foxglove for the topics of a trial's MCAP files.

A layout is a document of panels by name, and how they share the window. The topics are those of
`zfcal.artifacts`: ``/scene``, ``/poses``, ``/agents`` of poses, ``/CAMERA/image`` of frames,
``/targets``, ``/commands``, ``/robot``, ``/faults``, ``/log`` of drives.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

_FRAME = "arena"
"""The frame in which poses and scenes are."""

_VIEW_ANGLE_DEG = 45.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Topics:
    """What a trial has to show.

    Parameters
    ----------
    cameras
        Those of which there are images.
    has_poses, has_drive
        Whether there are files of them.
    """

    cameras: tuple[str, ...]
    has_poses: bool
    has_drive: bool

    def __bool__(self) -> bool:
        return bool(self.cameras) or self.has_poses or self.has_drive


def foxglove_layout(topics: Topics, bounds_m: tuple[float, float, float, float]) -> dict[str, Any]:
    """Return a layout: the tank from above, the images, and what the robot was told.

    Parameters
    ----------
    topics
        What there is.
    bounds_m
        Least x and y, greatest x and y of the tank, in metres.
    """
    panels: dict[str, dict[str, Any]] = {}
    views = []
    if topics.has_poses or topics.has_drive:
        panels["3D!tank"] = _tank(topics, bounds_m)
        views.append("3D!tank")
    for camera in topics.cameras:
        panels[f"Image!{camera}"] = {"imageMode": {"imageTopic": f"/{camera}/image"}}
        views.append(f"Image!{camera}")
    below = []
    if topics.has_poses:
        panels["RawMessages!agents"] = {"topicPath": "/agents", "diffEnabled": False}
        below.append("RawMessages!agents")
    if topics.has_drive:
        panels |= _drive()
        below += ["Plot!wheels", "StateTransitions!held", "RosOut!log"]
    whole = _split(views, "row")
    return {
        "configById": panels,
        "globalVariables": {},
        "userNodes": {},
        "playbackConfig": {"speed": 1},
        "layout": _pair(whole, _split(below, "row"), "column", 70) if below else whole,
    }


def _tank(topics: Topics, bounds_m: tuple[float, float, float, float]) -> dict[str, Any]:
    x0, y0, x1, y1 = bounds_m
    shown = {"/scene": {"visible": True}, "/poses": {"visible": False}}
    middle = [(x0 + x1) / 2, (y0 + y1) / 2, 0.0]
    return {
        "followTf": _FRAME,
        "followMode": "follow-none",
        "topics": shown if topics.has_poses else {"/scene": {"visible": True}},
        "cameraState": {
            # From above, x to the right and y up, with a margin round the tank.
            "perspective": False,
            "phi": 0.0,
            "thetaOffset": 0.0,
            "target": [0.0, 0.0, 0.0],
            "targetOffset": middle,
            "targetOrientation": [0.0, 0.0, 0.0, 1.0],
            "distance": 1.3 * max(x1 - x0, y1 - y0),
            "fovy": _VIEW_ANGLE_DEG,
            "near": 0.01,
            "far": 100.0,
        },
        "layers": {
            "grid": {
                "visible": True,
                "label": "Grid",
                "layerId": "foxglove.Grid",
                "instanceId": "grid",
                "frameId": _FRAME,
                "size": 2.0,
                "divisions": 20,
                "lineWidth": 1,
                "color": "#24888866",
                "position": [0, 0, 0],
                "rotation": [0, 0, 0],
            }
        },
    }


def _drive() -> dict[str, dict[str, Any]]:
    return {
        "Plot!wheels": {
            "title": "Speeds of the wheels, m/s",
            "paths": [_path("/commands.left_m_s"), _path("/commands.right_m_s")],
            "showLegend": True,
            "legendDisplay": "floating",
            "isSynced": True,
            "xAxisVal": "timestamp",
        },
        "StateTransitions!held": {
            "paths": [_path("/commands.held"), _path("/faults.fault")],
            "isSynced": True,
        },
        "RosOut!log": {"topicToRender": "/log", "searchTerms": [], "minLogLevel": 1},
    }


def _path(value: str) -> dict[str, Any]:
    return {"value": value, "enabled": True, "timestampMethod": "receiveTime"}


def _split(panels: Sequence[str], direction: str) -> Any:
    """Return panels side by side, each as wide as the others."""
    if len(panels) == 1:
        return panels[0]
    return _pair(panels[0], _split(panels[1:], direction), direction, 100 / len(panels))


def _pair(first: Any, second: Any, direction: str, percentage: float) -> dict[str, Any]:
    return {
        "first": first,
        "second": second,
        "direction": direction,
        "splitPercentage": round(percentage, 2),
    }
