"""Measure the tracker on drawn film with a hand or a large object in its first frames.

Film of seeds on which nothing was tuned, and its negative. Prints a table in Markdown.

    .venv/bin/python benchmarks/tracking/tracking_hands.py
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import cv2
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from benchmarks.shared.measuring import table
from benchmarks.tracking import bench_tracking
from benchmarks.tracking.bench_tracking import Film, drawn
from benchmarks.tracking.measures import measures
from zfcal.cameras.frames import Frame
from zfcal.tracking.seen import TrackerOptions
from zfcal.tracking.tracker import FishTracker, follow

SEEDS = (9104, 9106, 9205, 9206)
N_FRAMES, LATE = 300, 150
"""Frames that are tracked, and after which fish are to be found again: 20 and 10 s."""

ODD = {
    "light hand, 4 s": ("hand", 235, 60),
    "light hand, 7 s": ("hand", 235, 100),
    "dark hand, 7 s": ("hand", 70, 100),
    "light hand that moves, 7 s": ("moving hand", 235, 100),
    "dark hand that moves, 4 s": ("moving hand", 70, 60),
    "light disc, 4 s": ("disc", 240, 60),
}
"""What is drawn over the first frames: which shape, its grey, and in how many."""


def drawn_over(image: np.ndarray, k: int, shape: str, grey: int) -> np.ndarray:
    """Return an image with a hand and its arm, or a disc."""
    out = image.copy()
    height, width = out.shape
    if shape == "disc":
        return cv2.circle(out, (int(0.45 * width), int(0.55 * height)), 50, grey, -1, cv2.LINE_AA)
    x, y = 0.4, 0.4
    if shape == "moving hand":
        x, y = x + 0.1 * np.sin(k / 8), y + 0.1 * np.cos(k / 11)
    at = int(x * width), int(y * height)
    cv2.ellipse(out, at, (70, 45), 20, 0, 360, grey, -1)
    cv2.line(out, at, (at[0], 0), grey, 40)
    return out


def with_odd(film: Film, what: str, rng: np.random.Generator) -> list[np.ndarray]:
    """Return the images of a film, some of them drawn over, with the camera's noise."""
    shape, grey, last = ODD[what]
    images = [frame.image for frame in film.frames[:N_FRAMES]]
    for k in range(last):
        over = drawn_over(images[k], k, shape, grey)
        noisy = np.clip(over + rng.normal(0, 2, over.shape), 0, 255).astype(np.uint8)
        images[k] = np.where(over != images[k], noisy, images[k])
    return images


def measured(film: Film, images: list[np.ndarray]) -> tuple[str, float, float]:
    """Return the polarity, MOTA over all, and the recall once the first ten seconds are over."""
    options = TrackerOptions(n_agents=film.truth.shape[1])
    tracker = FishTracker(options, film.projection, region=film.region)
    frames = [Frame(number=k, time_s=k / film.fps, image=each) for k, each in enumerate(images)]
    rows = [
        [(s.agent, 1e3 * s.x_m, 1e3 * s.y_m) for s in seen] for _, seen in follow(tracker, frames)
    ]
    whole = measures(film.truth[: len(rows)], rows, gate=film.gate, fps=film.fps)
    late = measures(film.truth[LATE : len(rows)], rows[LATE:], gate=film.gate, fps=film.fps)
    return tracker.polarity, whole["mota"], late["recall"]


def main() -> None:
    """Measure everything; each row goes to standard error as soon as it is known."""
    bench_tracking.OTHERS = ()
    rng, rows = np.random.default_rng(5), []
    with tempfile.TemporaryDirectory() as folder:
        films = [drawn(seed, "usual", "30s", Path(folder)) for seed in SEEDS]
    for what in ODD:
        for negative in (False, True):
            found = []
            for film in films:
                images = with_odd(film, what, rng)
                found.append(measured(film, [~i for i in images] if negative else images))
            polarities, mota, late = zip(*found, strict=True)
            told = sum(each == ("light" if negative else "dark") for each in polarities)
            name = f"{what}, negative" if negative else what
            spread = [f"{np.median(v):.2f} ({min(v):.2f} to {max(v):.2f})" for v in (mota, late)]
            rows.append([name, f"{told} of {len(SEEDS)}", *spread])
            print(rows[-1], file=sys.stderr, flush=True)
    print(table(("in the first frames", "polarity right", "MOTA", "found after 10 s"), rows))


if __name__ == "__main__":
    main()
