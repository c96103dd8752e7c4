"""A search as bytes, so that a killed round goes on as if nothing had happened.

Deterministic: the same search gives the same bytes. Where they are kept, and that
they appear whole or not at all, is the caller's business.
"""

from __future__ import annotations

import io
import json
import zipfile
from dataclasses import asdict
from typing import Any

import numpy as np

from zfcal.calibrate.evolve import State
from zfcal.calibrate.history import Generation
from zfcal.calibrate.search import Progress
from zfcal.errors import DamagedError

FORMAT = "zfcal.checkpoint/1"

_STATE_ARRAYS = ("genes", "features", "objectives", "rank", "crowding")
_STATE_PLAIN = ("generation", "evaluations", "rng")
_PLAIN = ("world_changed", "n_renewed")


def to_bytes(progress: Progress, *, key: str) -> bytes:
    """Return a search as bytes.

    Parameters
    ----------
    progress
        Between two generations.
    key
        Says of which round it is: whatever changes its outcome belongs in it
        (inputs by hash, options, seed, version), but not the number of
        generations, the budget or the workers.
    """
    state = progress.state
    plain = {
        "format": FORMAT,
        "key": key,
        "state": {name: getattr(state, name) for name in _STATE_PLAIN},
        "history": [asdict(line) for line in progress.history],
        **{name: getattr(progress, name) for name in _PLAIN},
    }
    arrays = {f"state.{name}": getattr(state, name) for name in _STATE_ARRAYS}
    arrays |= {"genes": progress.genes, "features": progress.features}
    text = json.dumps(plain, sort_keys=True, default=_plain_number)
    buffer = io.BytesIO()
    np.savez(buffer, plain=np.frombuffer(text.encode(), dtype=np.uint8), **arrays)
    return buffer.getvalue()


def _plain_number(value: Any) -> Any:
    if isinstance(value, np.generic):
        return value.item()
    raise TypeError(f"{type(value).__name__} has no place in a checkpoint.")


def from_bytes(data: bytes, *, key: str) -> Progress | None:
    """Return the search that was saved.

    Parameters
    ----------
    data
        From `to_bytes`.
    key
        Of the round that wants to go on.

    Returns
    -------
    Progress or None
        None where the bytes are of another round or format: start anew.

    Raises
    ------
    DamagedError
        The bytes are cut or changed.
    """
    try:
        with np.load(io.BytesIO(data), allow_pickle=False) as archive:
            arrays = {name: archive[name] for name in archive.files}
        plain = json.loads(arrays.pop("plain").tobytes())
        if (plain["format"], plain["key"]) != (FORMAT, key):
            return None
        return _progress(plain, arrays)
    except (OSError, EOFError, ValueError, KeyError, TypeError, zipfile.BadZipFile) as error:
        raise DamagedError(
            f"The checkpoint of {len(data)} bytes cannot be read: {error}.",
            hint="Remove it; the round then starts anew and ends in the same result.",
        ) from error


def _progress(plain: dict[str, Any], arrays: dict[str, Any]) -> Progress:
    state = State(
        **{name: arrays[f"state.{name}"] for name in _STATE_ARRAYS},
        **{name: plain["state"][name] for name in _STATE_PLAIN},
    )
    return Progress(
        state=state,
        genes=arrays["genes"],
        features=arrays["features"],
        history=tuple(Generation(**line) for line in plain["history"]),
        **{name: plain[name] for name in _PLAIN},
    )
