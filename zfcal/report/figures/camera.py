"""How well a camera is calibrated, as a picture: errors in the image, in the tank, counted."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from zfcal.arrays import Floats
from zfcal.cameras.calibration import Calibration
from zfcal.cameras.calibration_boards import LensCalibration
from zfcal.report.figures import theme
from zfcal.report.figures.panels import Entry, Panel, Picture, write_picture

_ARROW_SHARE = 0.06
"""An error of usual size is drawn as long as this share of the picture."""

_FEW = 100
_NICE = np.array([1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000])
_MM = 1000.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Residuals:
    """What a calibration leaves unexplained.

    Parameters
    ----------
    title
        What was calibrated, and how.
    size_px
        Width and height of the images.
    px, off_px : ndarray, shape (n, 2)
        Points in the image, and where the fit sees them, less that.
    m, off_m : ndarray, shape (n, 2), or None
        The same in the tank; None for a lens alone.
    left_out_m : ndarray, shape (n, 2), or None
        Errors of points that the fit had not seen.
    """

    title: str
    size_px: tuple[int, int]
    px: Floats
    off_px: Floats
    m: Floats | None = None
    off_m: Floats | None = None
    left_out_m: Floats | None = None


def residuals_of(found: Calibration | LensCalibration) -> Residuals:
    """Return the errors of a camera, or of a lens alone."""
    if isinstance(found, LensCalibration):
        return Residuals(
            title=f"Lens: {found.result['method']}",
            size_px=found.lens.size_px,
            px=np.concatenate([view.px for view in found.views]),
            off_px=np.concatenate(found.residual_px),
        )
    return Residuals(
        title=f"Camera: {found.method}",
        size_px=found.camera.size_px,
        px=found.pairs.px,
        off_px=found.residual_px,
        m=found.pairs.m,
        off_m=found.residual_m,
        left_out_m=found.left_out_m,
    )


def draw_residuals(
    residuals: Residuals, path: Path, *, image: NDArray[np.uint8] | None = None
) -> None:
    """Write the errors of a calibration as a PNG.

    Parameters
    ----------
    residuals
        What is drawn.
    path
        Where the PNG goes, whatever its ending; its folder must be there.
    image : ndarray of uint8, shape (height, width) or (height, width, 3)
        What the camera sees, as a backdrop.
    """
    write_picture(residuals_picture(residuals, image=image), path)


def residuals_picture(residuals: Residuals, *, image: NDArray[np.uint8] | None = None) -> Picture:
    """Return the errors as a picture of two or three panels."""
    panels = [_image_panel(residuals, image)]
    if residuals.m is not None and residuals.off_m is not None:
        panels.append(_tank_panel(residuals.m, residuals.off_m))
    panels.append(_counts_panel(residuals))
    return Picture(
        name="camera",
        title=residuals.title,
        panels=tuple(panels),
        key=(
            Entry(label="point", colour=theme.INK, mark="points", marker="o"),
            Entry(label="toward where the fit puts it", colour=theme.MODEL, mark="line"),
        ),
        note="Arrows go from where a point is to where the calibration puts it, drawn longer.",
    )


def _image_panel(residuals: Residuals, image: NDArray[np.uint8] | None) -> Panel:
    width, height = residuals.size_px
    times = _times(residuals.off_px, max(residuals.size_px))

    def draw(axes: Axes) -> None:
        if image is not None:
            shown = image if image.ndim == 2 else image[..., ::-1]
            axes.imshow(shown, cmap="gray", alpha=0.6, vmin=0, vmax=255)
        _arrows(axes, residuals.px, times * residuals.off_px)
        axes.set(xlim=(-0.5, width - 0.5), ylim=(height - 0.5, -0.5), xlabel="px", ylabel="px")
        axes.set_aspect("equal")
        axes.grid(visible=False)

    return Panel(
        title=f"In the image, errors × {times}",
        alt=f"{len(residuals.px)} points in an image of {width} by {height} px, with arrows.",
        draw=draw,
        size_in=_size(width / height),
    )


def _tank_panel(m: Floats, off_m: Floats) -> Panel:
    extent_m = np.ptp(m, axis=0)
    times = _times(off_m, float(extent_m.max()))

    def draw(axes: Axes) -> None:
        _arrows(axes, m, times * off_m)
        axes.set(xlabel="x (m)", ylabel="y (m)")
        axes.set_aspect("equal")
        axes.margins(0.12)

    return Panel(
        title=f"In the tank, errors × {times}",
        alt=f"{len(m)} points in the tank, with arrows.",
        draw=draw,
        size_in=_size(1.0),
    )


def _counts_panel(residuals: Residuals) -> Panel:
    unit = "px" if residuals.off_m is None else "mm"
    found = residuals.off_px if residuals.off_m is None else _MM * residuals.off_m
    lengths = _lengths(found)
    unseen = np.empty(0)
    if residuals.left_out_m is not None:
        unseen = _lengths(_MM * residuals.left_out_m)

    def draw(axes: Axes) -> None:
        top = float(max(lengths.max(initial=0.0), unseen.max(initial=0.0), 1e-6))
        edges = np.linspace(0, top, 21).tolist()
        axes.hist(lengths, edges, color=theme.MODEL, alpha=0.8, label="by the fit")
        if len(unseen):
            axes.hist(
                unseen, edges, histtype="step", color=theme.FISH, lw=1.5, label="of points left out"
            )
            axes.legend(loc="upper right", frameon=False, fontsize=7)
        axes.set(xlabel=f"error ({unit})", ylabel="points", xlim=(0, top))

    middle = float(np.median(lengths)) if len(lengths) else float("nan")
    return Panel(
        title=f"Median {middle:.2f} {unit}",
        alt=f"Histogram of {len(lengths)} errors in {unit}.",
        draw=draw,
        size_in=_size(1.0),
    )


def _arrows(axes: Axes, places: Floats, vectors: Floats) -> None:
    axes.quiver(
        *places.T,
        *vectors.T,
        angles="xy",
        scale_units="xy",
        scale=1,
        color=theme.MODEL,
        width=0.004,
        headwidth=4,
    )
    # Hundreds of points would hide the arrows.
    axes.plot(*places.T, "o", color=theme.INK, ms=2.5 if len(places) <= _FEW else 0.8, zorder=1)


def _times(vectors: Floats, extent: float) -> int:
    """Return by how much errors are drawn longer than they are."""
    lengths = _lengths(vectors)
    usual = float(np.percentile(lengths, 90)) if len(lengths) else 0.0
    if not usual > 0:
        return 1
    wanted = _ARROW_SHARE * extent / usual
    return int(_NICE[np.clip(np.searchsorted(_NICE, wanted, side="right") - 1, 0, len(_NICE) - 1)])


def _lengths(vectors: Floats) -> Floats:
    found = np.hypot(*vectors.T)
    return np.asarray(found[np.isfinite(found)], np.float64)


def _size(ratio: float) -> tuple[float, float]:
    return 3.3 * ratio, 3.3
