"""What `zfcal demo` says: how long it takes; at its end what to look at, and what to run next."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import Any


def takes(loop: dict[str, Any] | None) -> str:
    """Return how long it would take, in words.

    Parameters
    ----------
    loop
        Options of a closed loop; None without it.
    """
    from zfcal.model.kernels.compiled import is_warm
    from zfcal.virtual.demo_steps import ABOUT_S, about_s

    seconds = ABOUT_S
    if loop is not None:
        seconds = about_s(
            loop["duration_s"] or 600.0, video=not loop["no_video"], real_time=loop["real_time"]
        )
    words = f"It takes about {seconds / 60:.0f} min" if seconds > 90 else "It takes about a minute"
    first = "" if is_warm() else ", and half a minute more to compile, the first time"
    return f"{words} on two cores with nothing else to do{first}."


def closing(folder: Path, trial: Path, *, is_loop: bool) -> list[str]:
    """Return the lines, without what is not there.

    Parameters
    ----------
    folder
        Where the demonstration lies.
    trial
        Its trial.
    is_loop
        Whether it was a closed loop.
    """
    models = sorted(path for path in (trial / "models").glob("*.toml") if path.stem.isdigit())
    logs = sorted((trial / "drive").glob("*.mcap"))
    places = [
        (trial / "report" / "index.html", "scores beside their ceilings, and figures"),
        (folder / "contact-sheet.png", "the frames with which most is wrong"),
        *((path, "the model of the last round") for path in models[-1:]),
        *((path, "what the robot was sent, and by which model") for path in logs[:1]),
    ]
    where = shlex.quote(str(trial))
    commands = [
        (f"zfcal check {where}", "every file, and this computer"),
        (f"zfcal drive {where} --replay", "the log of the drive, worked out again"),
        (f"zfcal diagnose {where} --quick", "what the model lacks; three minutes show little"),
    ]
    if not is_loop:
        loop = "zfcal demo loop --closed-loop --no-video --duration 5min"
        commands.append((loop, "fish that react to the robot"))
    commands.append(("zfcal init --help", "a trial of your own"))
    shown = [(str(path), what) for path, what in places if path.exists()]
    return ["What to look at:", *_table(shown), "What to run next:", *_table(commands)]


def _table(rows: list[tuple[str, str]]) -> list[str]:
    widest = max((len(left) for left, _ in rows), default=0)
    return [f"  {left.ljust(widest)}  {right}" for left, right in rows]
