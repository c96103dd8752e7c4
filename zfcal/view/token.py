"""The secret in the address of a trial's page: who knows it may look.

It stays the same while the trial lies where it is, so that an open page finds its server again.
"""

from __future__ import annotations

import contextlib
import os
import re
import secrets
from pathlib import Path

TOKEN_NAME = ".view-token"  # noqa: S105 - where it lies, not what it is

_BYTES = 18
_FORM = re.compile(r"[A-Za-z0-9_-]{24}")


def token_of(root: Path) -> str:
    """Return the secret of a trial's page; a new one where there is none that is kept well.

    Parameters
    ----------
    root
        The trial's directory. Where nothing can be written, the secret is new each time.
    """
    path = root / TOKEN_NAME
    kept = _kept(path)
    if kept is not None:
        return kept
    made = secrets.token_urlsafe(_BYTES)
    try:
        path.unlink(missing_ok=True)
        descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
    except OSError:
        return made
    try:
        with os.fdopen(descriptor, "w", encoding="ascii") as file:
            file.write(made)
    except OSError:
        # The disk is full: half a secret is none.
        with contextlib.suppress(OSError):
            path.unlink()
    return made


def _kept(path: Path) -> str | None:
    """Return a secret that nobody else can read; None for any other."""
    try:
        status = path.lstat()
        text = path.read_text(encoding="ascii")
    except (OSError, ValueError):
        return None
    # Windows has neither, and keeps what lies in a person's folders from others.
    user = getattr(os, "geteuid", None)
    is_open = user is not None and (status.st_mode & 0o077 or status.st_uid != user())
    return None if is_open or path.is_symlink() or not _FORM.fullmatch(text) else text
