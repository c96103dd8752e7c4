"""A search as bytes, so that a killed round goes on as if nothing had happened.

The bytes are blocks, the first a whole search and each further one what a later
generation adds, so that a long search does not write its beginnings again and again.
A block that was cut, as the last one of a killed process may be, is left out with all
that follows: the search goes on from the generation before.

Deterministic: the same search gives the same bytes. Where they are kept is the
caller's business.
"""

from __future__ import annotations

import io
import json
import struct
import zipfile
import zlib
from dataclasses import fields
from typing import Any

import numpy as np

from zfcal.calibrate.evolve import State
from zfcal.calibrate.history import Generation
from zfcal.calibrate.search import Progress
from zfcal.errors import DamagedError

_FORMAT = "zfcal.checkpoint/2"

_STATE_ARRAYS = ("genes", "features", "objectives", "rank", "crowding")
_STATE_PLAIN = ("generation", "evaluations", "rng")
_PLAIN = ("world_changed", "n_renewed")
_LINE = tuple(field.name for field in fields(Generation))

_HEAD = struct.Struct("<8sQI")
"""What begins a block: a mark, the length of its body and the body's CRC-32."""
_MARK = b"zfcal\x00c2"


def to_bytes(progress: Progress, *, key: str, since: Progress | None = None) -> bytes:
    """Return a search as a block of bytes.

    Parameters
    ----------
    progress
        Between two generations.
    key
        Says of which round it is: whatever changes its outcome belongs in it
        (inputs by hash, options, seed, version), but not the number of
        generations, the budget or the workers.
    since
        An earlier state of the same search, whose blocks come before; None for a
        block that needs no other.
    """
    state = progress.state
    n_parts, n_lines = (0, 0) if since is None else (len(since.parts), len(since.history))
    new = progress.parts[n_parts:]
    plain = {
        "format": _FORMAT,
        "key": key,
        "lines_before": n_lines,
        "state": {name: getattr(state, name) for name in _STATE_PLAIN},
        "history": [[getattr(line, name) for name in _LINE] for line in progress.history[n_lines:]],
        **{name: getattr(progress, name) for name in _PLAIN},
    }
    arrays = {f"state.{name}": getattr(state, name) for name in _STATE_ARRAYS}
    # A search without a new generation has no new part.
    arrays |= {"genes": np.concatenate([state.genes[:0], *(genes for genes, _ in new)])}
    arrays |= {"features": np.concatenate([state.features[:0], *(values for _, values in new)])}
    text = json.dumps(plain, sort_keys=True, default=_plain_number)
    buffer = io.BytesIO()
    np.savez(buffer, plain=np.frombuffer(text.encode(), dtype=np.uint8), **arrays)
    body = buffer.getvalue()
    return _HEAD.pack(_MARK, len(body), zlib.crc32(body)) + body


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
        Not even the first block is whole.
    """
    bodies = _whole_bodies(data)
    try:
        blocks = [_opened(body) for body in bodies]
        if any((plain["format"], plain["key"]) != (_FORMAT, key) for plain, _ in blocks):
            return None
        return _progress(blocks)
    except (OSError, EOFError, ValueError, KeyError, TypeError, zipfile.BadZipFile) as error:
        raise DamagedError(
            f"The checkpoint of {len(data)} bytes cannot be read: {error}.",
            hint="Remove it; the round then starts again and ends in the same result.",
        ) from error


def _whole_bodies(data: bytes) -> list[bytes]:
    """Return the bodies of the blocks up to the first that is cut or changed."""
    bodies: list[bytes] = []
    at = 0
    while at + _HEAD.size <= len(data):
        mark, length, checksum = _HEAD.unpack_from(data, at)
        body = data[at + _HEAD.size : at + _HEAD.size + length]
        if mark != _MARK or len(body) < length or zlib.crc32(body) != checksum:
            break
        bodies.append(body)
        at += _HEAD.size + length
    return bodies


def _opened(body: bytes) -> tuple[dict[str, Any], dict[str, Any]]:
    with np.load(io.BytesIO(body), allow_pickle=False) as archive:
        arrays = {name: archive[name] for name in archive.files}
    return json.loads(arrays.pop("plain").tobytes()), arrays


def _progress(blocks: list[tuple[dict[str, Any], dict[str, Any]]]) -> Progress:
    if not blocks:
        raise ValueError("the first block is cut or changed")
    history: list[Generation] = []
    for plain, _ in blocks:
        if plain["lines_before"] != len(history):
            raise ValueError(f"a block follows generation {plain['lines_before'] - 1}")
        lines = (dict(zip(_LINE, line, strict=True)) for line in plain["history"])
        history += [Generation(**line) for line in lines]
    plain, arrays = blocks[-1]
    return Progress(
        state=State(
            **{name: arrays[f"state.{name}"] for name in _STATE_ARRAYS},
            **{name: plain["state"][name] for name in _STATE_PLAIN},
        ),
        parts=tuple((own["genes"], own["features"]) for _, own in blocks),
        history=tuple(history),
        **{name: plain[name] for name in _PLAIN},
    )
