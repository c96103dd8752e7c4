"""Which model drives: the highest number in ``models/``, as soon as it can be read."""

from __future__ import annotations

import hashlib
import math
from pathlib import Path
from typing import final

from zfcal.artifacts.models import read_model_for
from zfcal.errors import InputError, ZfcalError
from zfcal.model.packing import pack
from zfcal.online.opening import OpenTrial
from zfcal.online.pilot import InForce
from zfcal.trial import second_of


@final
class DriveModels:
    """Looks for the newest model of a trial.

    Parameters
    ----------
    opened
        The trial.
    after_s
        A model that is there sooner drives only so many seconds after its window has ended;
        the starting model at once.

    Attributes
    ----------
    problem
        What is wrong with a file that was passed over at the last look; empty for nothing.
    """

    def __init__(self, opened: OpenTrial, *, after_s: float = -math.inf) -> None:
        self._opened, self._after_s = opened, after_s
        self._folder = opened.trial.root / "models"
        self._force: InForce | None = None
        self._known: tuple[int, tuple[int, int, int]] | None = None
        self._bad: dict[Path, tuple[int, int, int]] = {}
        self.problem = ""

    def first(self) -> InForce:
        """Return the model to begin with.

        Raises
        ------
        InputError
            There is none that can be used, and why.
        """
        if self.look() or self._force is not None:
            assert self._force is not None  # noqa: S101 - for the type checker
            return self._force
        raise InputError(
            self.problem or f"{self._folder}: holds no numbered model.",
            hint=f"Make one with: zfcal calibrate {self._opened.trial.root}",
        )

    def look(self, now_s: float = math.inf) -> InForce | None:
        """Return a model that is newer than the last one; None if there is none.

        Parameters
        ----------
        now_s
            Seconds since the trial began.
        """
        self.problem = ""
        for second, path in sorted(self._files(), reverse=True):
            if second and second + self._after_s > now_s:
                continue
            sign = _sign(path)
            if sign is None or self._bad.get(path) == sign:
                continue
            if self._known is not None and self._known[0] > second:
                return None
            if self._known == (second, sign):
                return None
            found = self._read(path)
            if _sign(path) != sign:
                # Replaced while it was read: the next look has it.
                continue
            if found is None:
                self._bad[path] = sign
                continue
            self._known, self._force = (second, sign), found
            return found
        return None

    def _files(self) -> list[tuple[int, Path]]:
        found = [(second_of(path, ".toml"), path) for path in self._folder.glob("*.toml")]
        return [(second, path) for second, path in found if second is not None]

    def _read(self, path: Path) -> InForce | None:
        opened = self._opened
        try:
            data = path.read_bytes()
            model = read_model_for(path, opened.arena, dt_s=opened.trial.dt_s)
            packed = pack([model], opened.arena)
        except (ZfcalError, OSError) as error:
            self.problem = str(error)
            return None
        return InForce(
            name=path.relative_to(opened.trial.root).as_posix(),
            sha256=hashlib.sha256(data).hexdigest(),
            text=data.decode(errors="replace"),
            parameters=model,
            packed=packed,
        )


def _sign(path: Path) -> tuple[int, int, int] | None:
    """Return by what another file of the same name is told; None if it has gone."""
    try:
        found = path.stat()
    except OSError:
        return None
    return (found.st_ino, found.st_mtime_ns, found.st_size)
