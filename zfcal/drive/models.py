"""Which model drives: the highest number in ``models/``, as soon as it can be read."""

from __future__ import annotations

import hashlib
import math
from contextlib import suppress
from pathlib import Path
from typing import final

from zfcal.artifacts.freshness import relative_to
from zfcal.artifacts.models import read_model_for
from zfcal.artifacts.reading.contents import Looks, looks_of, numbered_of, one_content, read_bytes
from zfcal.drive.pilot import InForce
from zfcal.errors import InputError, ZfcalError
from zfcal.model.effects.genome import check_effects
from zfcal.model.packing import pack
from zfcal.stages.trial_context import OpenTrial


@final
class DriveModels:
    """Looks for the newest model of a trial.

    Parameters
    ----------
    opened
        The trial.
    only
        The one file that drives, read again when it has changed; None for the newest numbered one.
    after_s
        A model that is there sooner drives only so many seconds after its window has ended;
        the starting model at once.

    Attributes
    ----------
    problem
        What is wrong with the files that were passed over at the last look; empty for nothing.
    """

    def __init__(
        self, opened: OpenTrial, *, only: Path | None = None, after_s: float = -math.inf
    ) -> None:
        self._opened, self._only, self._after_s = opened, only, after_s
        self._folder = opened.trial.root / "models"
        self._force: InForce | None = None
        self._known: tuple[int, Looks] | None = None
        self._bad: dict[Path, Looks | None] = {}
        self.problem = self._hint = ""

    def first(self) -> InForce:
        """Return the model to begin with.

        Raises
        ------
        InputError
            There is none that can be used, and why.
        """
        found = self.look() or self._force
        if found is not None:
            return found
        if self._only is not None:
            raise InputError(
                self.problem or f"{self._only}: cannot be read.",
                hint=self._hint or "Name a model file of this trial's arena and step.",
            )
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
        for second, path in self._files():
            if second and second + self._after_s > now_s:
                continue
            sign = _looks_of(path)
            if sign is None or self._bad.get(path) == sign:
                continue
            if self._known is not None and self._known[0] > second:
                return None
            if self._known == (second, sign):
                return None
            found = self._read(path)
            if _looks_of(path) != sign:
                # Replaced while it was read: the next look has it.
                continue
            if found is None:
                self._bad[path] = sign
                continue
            self._known, self._force = (second, sign), found
            return found
        return None

    def _files(self) -> list[tuple[int, Path]]:
        """Return the numbered models, the newest first, or the one that is named."""
        if self._only is not None:
            return [(0, self._only)]
        try:
            found = numbered_of(self._folder, ".toml")
        except InputError as error:
            sign = looks_of(self._folder)
            if self._bad.get(self._folder) != sign:
                self._bad[self._folder] = sign
                self._note(error)
            return []
        return sorted(found.items(), reverse=True)

    def _read(self, path: Path) -> InForce | None:
        opened = self._opened
        try:
            with one_content():
                data = read_bytes(path)
                model = read_model_for(path, opened.arena, dt_s=opened.trial.dt_s)
            check_effects(model, of=path)
            packed = pack([model], opened.arena)
        except ZfcalError as error:
            self._note(error)
            return None
        return InForce(
            name=relative_to(opened.trial.root, path),
            sha256=hashlib.sha256(data).hexdigest(),
            text=data.decode(errors="replace"),
            parameters=model,
            packed=packed,
        )

    def _note(self, error: ZfcalError) -> None:
        self.problem = f"{self.problem} {error}".lstrip()
        self._hint = error.hint


def _looks_of(path: Path) -> Looks | None:
    """Return what a file looks like; where a link leads nowhere, the link: it is named."""
    looks = looks_of(path)
    if looks is None and path.is_symlink():
        with suppress(OSError):
            status = path.lstat()
            return (status.st_dev, status.st_ino, status.st_mtime_ns)
    return looks
