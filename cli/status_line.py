"""The status line of `zfcal watch` and `zfcal drive`, on standard error when it is a terminal."""

from __future__ import annotations

from typing import TYPE_CHECKING, final

if TYPE_CHECKING:
    from rich.live import Live
    from rich.table import Table

    from zfcal.drive.events import DriveStatus
    from zfcal.online.watch_events import StageStatus, Status


def describe(status: Status) -> str:
    """Return the state of a watch on one line."""
    if status.is_gone:
        return "the trial is gone; waits"
    parts = [_stage(name, stage) for name, stage in status.stages.items()]
    if status.score is not None:
        ceiling = "" if status.ceiling is None else f" of {status.ceiling:.3f}"
        rule = f" by {status.rule}" if status.rule else ""
        parts.append(f"S {status.score:.3f}{ceiling}{rule}")
    if status.lag_s is not None:
        parts.append(f"lag {status.lag_s:.0f} s")
    if status.n_skipped:
        parts.append(f"skipped {status.n_skipped}")
    return " · ".join(parts)


def _stage(name: str, stage: StageStatus) -> str:
    if stage.problem:
        return f"{name}: fails, tries again"
    if stage.now_s is not None:
        far = f" {stage.done}/{stage.total}" if stage.total else ""
        return f"{name}: to {stage.now_s} s{far}"
    return f"{name}: waits" if stage.last_s is None else f"{name}: done to {stage.last_s} s"


def describe_drive(status: DriveStatus) -> str:
    """Return the state of a driver on one line."""
    if status.time_s is None:
        return f"drive: waits for poses · {status.model}"
    total = "" if status.total_s is None else f" of {status.total_s:.0f}"
    parts = [f"drive: {status.time_s:.0f}{total} s", status.model]
    latencies = {"pose": status.pose_to_state_s, "tick": status.tick_to_byte_s}
    late = [f"{name} {1e3 * s:.0f} ms" for name, s in latencies.items() if s is not None]
    parts += [", ".join(late)] if late else []
    parts += [f"missed {status.steps_missed}"] if status.steps_missed else []
    parts += [f"held: {status.held}"] if status.held else []
    return " · ".join(parts)


@final
class StatusLine:
    """One line that is drawn again and again, and wiped before anything else is written.

    Parameters
    ----------
    shown
        False for a stderr that is no terminal, or a quiet run: all does nothing.
    """

    def __init__(self, *, shown: bool) -> None:
        self._shown = shown
        self._live: Live | None = None

    def show(self, state: str | Table) -> None:
        """Draw the state, on one line or as a table."""
        if not self._shown:
            return
        from rich.text import Text

        live = self._live or self._start()
        drawn = Text(state, no_wrap=True, overflow="ellipsis") if isinstance(state, str) else state
        live.update(drawn, refresh=True)

    def clear(self) -> None:
        """Wipe the line."""
        if self._live is not None:
            self._live.stop()
            self._live = None

    def _start(self) -> Live:
        from rich.console import Console
        from rich.live import Live

        self._live = Live(console=Console(stderr=True), transient=True, auto_refresh=False)
        self._live.start()
        return self._live
