"""The image of another camera that belongs to a moment."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import final

from zfcal.cameras.live import LiveCamera
from zfcal.cameras.stamps import Shot, Source
from zfcal.tracking.robot import NEAR_S

_MOMENT_S = 0.02
"""At 15 Hz an image that is older than 50 ms is followed by the next within 17."""


@final
class Nearest:
    """Gives the image of a second camera that is nearest in time.

    Of a recording that is the nearest of all; of a live camera the nearest that has
    arrived; where that is too old, it is waited a moment for the next.

    Parameters
    ----------
    source
        The second camera.
    shots
        Its images; a live camera is asked for its newest instead.
    keep
        Takes each image as it comes and returns it, such as what records it.
    """

    def __init__(
        self,
        source: Source,
        shots: Iterator[Shot],
        *,
        keep: Callable[[Shot], Shot] | None = None,
    ) -> None:
        self._keep = keep or (lambda shot: shot)
        self._live = source if isinstance(source, LiveCamera) else None
        # Of a live camera they are not asked for any more: closing them would stop it.
        self._shots = shots
        self._known: list[Shot] = []

    def at(self, time_s: float) -> Shot | None:
        """Return the image nearest to a time, which grows from call to call.

        Parameters
        ----------
        time_s
            Seconds since the start of the trial.

        Returns
        -------
        Shot or None
            None if none lies within 50 ms.
        """
        if self._live:
            self._known += map(self._keep, self._live.newest())
            if not self._has(time_s):
                # The cameras are out of step: the next image is due in a moment.
                more = self._live.newest(patience_s=_MOMENT_S)
                self._known += map(self._keep, more)
        while not self._live and (not self._known or self._known[-1].time_s < time_s):
            shot = next(self._shots, None)
            if shot is None:
                break
            self._known.append(self._keep(shot))
        if not self._known:
            return None
        nearest = min(self._known, key=lambda shot: abs(shot.time_s - time_s))
        # Only what is later than the nearest may be wanted the next time.
        self._known = [shot for shot in self._known if shot.time_s >= nearest.time_s]
        return nearest if self._has(time_s) else None

    def _has(self, time_s: float) -> bool:
        # A microsecond over is rounding of time stamps.
        return any(abs(shot.time_s - time_s) <= NEAR_S + 1e-6 for shot in self._known)

    def close(self) -> None:
        """End the reading."""
        if self._live:
            self._live.stop()
