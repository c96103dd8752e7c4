"""Compiled loops are kept only as long as no source of theirs has changed.

The compiler's own cache looks at the file of a function alone, not at the constants
and functions that it takes from other files.
"""

import hashlib
import os
from pathlib import Path

_FOLDER = Path(__file__).parent
_SOURCES = (
    "geometry.py", "states.py", "surroundings.py", "further_heading.py", "heading.py",
    "further_speed.py", "speeds.py", "kernels.py", "oracle.py",
)  # fmt: skip


def forget_stale_kernels(folder: Path = _FOLDER) -> bool:
    """Delete the compiled loops in a folder when a source has changed; say whether."""
    text = b"".join((folder / name).read_bytes() for name in _SOURCES)
    digest, cache = hashlib.sha256(text).hexdigest(), folder / "__pycache__"
    cache.mkdir(exist_ok=True)
    note = cache / "compiled-from.sha256"
    if note.is_file() and note.read_text() == digest:
        return False
    for path in (*cache.glob("*.nbi"), *cache.glob("*.nbc")):
        path.unlink(missing_ok=True)
    part = cache / f"compiled-from.{os.getpid()}"
    part.write_text(digest)
    part.replace(note)
    return True
