"""The options of `zfcal track`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from .camera_options import SIDES
from .durations import seconds
from .options import EXISTING, NAME, PLACE, adds

if TYPE_CHECKING:
    from zfcal.stages.track.plan import TrackOptions

METHODS = ("shi-tomasi", "silhouette")

tracking_options = adds(
    click.option("--overhead", type=NAME, metavar="SRC", help="The camera that sees the fish."),
    click.option(
        "--below", type=NAME, metavar="SRC", help="The camera that sees the robot's LEDs."
    ),
    click.option("--camera", type=EXISTING, help="Calibration of the camera overhead."),
    click.option("--below-camera", type=EXISTING, help="Calibration of the camera below."),
    click.option(
        "--corners",
        metavar='"X,Y X,Y X,Y X,Y"',
        help="Instead of --camera: pixels of the arena's lower left, lower right, upper right "
        "and upper left corner.",
    ),
    click.option(
        "--seen-from",
        "side",
        type=click.Choice(SIDES),
        help="Where the camera overhead looks from, if not from above.",
    ),
    click.option(
        "--below-seen-from",
        "below_side",
        type=click.Choice(SIDES),
        help="Where the camera below looks from, if not from below.",
    ),
    click.option("--background", type=EXISTING, help="Image of the empty tank; default: learnt."),
    click.option(
        "--method",
        type=click.Choice(METHODS),
        default=METHODS[0],
        show_default=True,
        help="shi-tomasi is the published one.",
    ),
    click.option("--harris", is_flag=True, help="Harris' corner measure."),
    click.option("--light", is_flag=True, help="Fish are lighter than the tank."),
    click.option("--dark", is_flag=True, help="They are darker; default: learnt."),
    click.option("--either", is_flag=True, help="Some are lighter, some darker."),
    click.option(
        "--min-blob-px",
        type=click.FloatRange(min=0, min_open=True),
        help="Smallest blob; default: learnt.",
    ),
    click.option("--led-hue", type=click.FloatRange(0, 360), help="Hue of the LEDs, in degrees."),
    click.option("--robot-as-fish", is_flag=True, help="No camera below: the robot is one more."),
    click.option("--start", "start_s", type=seconds, metavar="TIME", help="Skip so much."),
    click.option("--duration", "duration_s", type=seconds, metavar="TIME", help="Such as 30min."),
    click.option(
        "--record", type=click.Choice(["jpeg", "png"]), help="Keep a live camera's images."
    ),
    click.option("--overlay", type=PLACE, help="Draw what was found into this video (.mp4)."),
    click.option("--contact-sheet", type=PLACE, help="Draw the worst frames into this PNG."),
)


def track_options(given: dict[str, Any]) -> TrackOptions:
    """Return what the options ask for."""
    from zfcal.stages.camera.rig import CameraChoice
    from zfcal.stages.track.plan import Pictures, TrackOptions
    from zfcal.tracking.robot import LedOptions
    from zfcal.tracking.seen import TrackerOptions

    return TrackOptions(
        overhead=CameraChoice(
            source=given["overhead"],
            file=given["camera"],
            corners_px=_corners(given["corners"]),
            side=given["side"],
        ),
        below=CameraChoice(
            source=given["below"], file=given["below_camera"], side=given["below_side"]
        ),
        tracker=TrackerOptions(
            method=given["method"],
            harris=given["harris"],
            polarity=_polarity(given),
            min_blob_px=given["min_blob_px"],
        ),
        leds=LedOptions(hue_deg=given["led_hue"]),
        background=given["background"],
        robot_as_fish=given["robot_as_fish"],
        start_s=given["start_s"],
        duration_s=given["duration_s"],
        record=given["record"],
        pictures=Pictures(overlay=given["overlay"], contact_sheet=given["contact_sheet"]),
    )


def _polarity(given: dict[str, Any]) -> str | None:
    """Return what fish are said to be, compared with the tank; None for no word."""
    said = [name for name in ("light", "dark", "either") if given[name]]
    if len(said) > 1:
        raise click.UsageError(f"{' and '.join(f'--{name}' for name in said)}: give one of them.")
    return said[0] if said else None


def _corners(text: str | None) -> tuple[tuple[float, float], ...] | None:
    """Return the pixels of four corners, typed as eight numbers."""
    if text is None:
        return None
    try:
        numbers = [float(word) for word in text.replace(",", " ").split()]
    except ValueError:
        numbers = []
    if len(numbers) != 8:
        raise click.BadParameter(
            f"{text!r} are no four points: expected eight numbers X,Y,X,Y,X,Y,X,Y.",
            param_hint="--corners",
        )
    return tuple(zip(numbers[::2], numbers[1::2], strict=True))
