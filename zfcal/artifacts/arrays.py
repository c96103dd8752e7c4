"""Arrow arrays from plain values and back, without pandas.

pyarrow loads pandas as soon as it takes or gives an array of NumPy, which takes as long
as all else that a short command does. What is common is therefore laid out here as
Arrow wants it; what is not goes the usual way and comes to the same.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import accumulate
from typing import Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from zfcal.arrays import Bools

_DTYPES: dict[Any, np.dtype[Any]] = {
    pa.float64(): np.dtype(np.float64),
    pa.float32(): np.dtype(np.float32),
    pa.int64(): np.dtype(np.int64),
    pa.int32(): np.dtype(np.int32),
    pa.int8(): np.dtype(np.int8),
}


def array_of(values: Any, kind: pa.DataType, *, nan_is_null: bool = False) -> pa.Array:
    """Return an Arrow array, as `pyarrow.array` would.

    Parameters
    ----------
    values
        A sequence or array; None is null.
    kind
        The type that it is to have.
    nan_is_null
        Whether NaN becomes null.

    Raises
    ------
    pyarrow.ArrowException, ValueError, TypeError, OverflowError
        A value is not of the type.
    """
    made = None
    if kind == pa.string():
        made = _strings(values)
    elif kind in _DTYPES:
        made = _numbers(values, kind, nan_is_null=nan_is_null)
    elif pa.types.is_list(kind) and kind.value_type in _DTYPES:
        made = _lists(values, kind)
    return pa.array(values, type=kind, from_pandas=nan_is_null) if made is None else made


def dictionary_of(values: Any, known: Sequence[str]) -> pa.DictionaryArray:
    """Return strings as codes of int8 into those that are known; None is null.

    Raises
    ------
    ValueError
        One is not known.
    """
    codes: dict[Any, int | None] = {word: code for code, word in enumerate(known)}
    codes[None] = None
    words = values.tolist() if isinstance(values, np.ndarray) else list(values)
    for word in dict.fromkeys(words):
        if word not in codes:
            message = f"{word!r} is none of {', '.join(known)}"
            raise ValueError(message)
    return pa.DictionaryArray.from_arrays(
        array_of([codes[word] for word in words], pa.int8()), array_of(list(known), pa.string())
    )


def numbers_of(values: pa.Array | pa.ChunkedArray) -> NDArray[Any]:
    """Return a NumPy array, as ``values.to_numpy()`` would.

    Parameters
    ----------
    values
        Of any type. Numbers of which none is null are not converted, and may share
        the memory of ``values``: do not write to them.
    """
    dtype = _DTYPES.get(values.type)
    if dtype is None or values.null_count:
        return np.asarray(values.to_numpy(zero_copy_only=False))
    chunks = values.chunks if isinstance(values, pa.ChunkedArray) else [values]
    views = [
        np.frombuffer(chunk.buffers()[1], dtype=dtype)[chunk.offset : chunk.offset + len(chunk)]
        for chunk in chunks
        if len(chunk)
    ]
    if len(views) == 1:
        return views[0]
    return np.concatenate(views) if views else np.zeros(0, dtype=dtype)


def _numbers(values: Any, kind: pa.DataType, *, nan_is_null: bool) -> pa.Array | None:
    """Return numbers that need no conversion but from Python's; None if they do."""
    dtype = _DTYPES[kind]
    null: Bools | None = None
    if isinstance(values, np.ndarray):
        if values.dtype != dtype or values.ndim != 1:
            return None
        numbers = np.ascontiguousarray(values)
    else:
        plain = {int, type(None)} | ({float} if dtype.kind == "f" else set())
        if not isinstance(values, list | tuple) or not set(map(type, values)) <= plain:
            return None
        null = np.fromiter((value is None for value in values), np.bool_, len(values))
        numbers = np.array([0 if value is None else value for value in values], dtype=dtype)
    if nan_is_null and dtype.kind == "f":
        lost = np.isnan(numbers)
        null = lost if null is None else null | lost
    return _from_parts(kind, numbers, [], null)


def _strings(values: Any) -> pa.Array | None:
    """Return text; None if there is anything else."""
    if not isinstance(values, list | tuple) or not set(map(type, values)) <= {str, type(None)}:
        return None
    parts = [b"" if value is None else value.encode() for value in values]
    ends = np.fromiter(accumulate(map(len, parts), initial=0), np.int64, len(parts) + 1)
    if ends[-1] > np.iinfo(np.int32).max:
        return None
    null = np.fromiter((value is None for value in values), np.bool_, len(values))
    data = pa.py_buffer(b"".join(parts))
    return _from_parts(pa.string(), ends.astype(np.int32), [data], null)


def _lists(values: Any, kind: pa.DataType) -> pa.Array | None:
    """Return a list of numbers per row; None if there is anything else."""
    if not isinstance(values, list | tuple) or not set(map(type, values)) <= {list, tuple}:
        return None
    flat = [number for row in values for number in row]
    numbers = _numbers(flat, kind.value_type, nan_is_null=False)
    if numbers is None or len(flat) > np.iinfo(np.int32).max:
        return None
    ends = np.fromiter(accumulate(map(len, values), initial=0), np.int32, len(values) + 1)
    return pa.Array.from_buffers(
        kind, len(values), [None, pa.py_buffer(ends)], null_count=0, children=[numbers]
    )


def _from_parts(
    kind: pa.DataType, first: NDArray[Any], more: list[pa.Buffer], null: Bools | None
) -> pa.Array:
    n = len(first) - len(more)
    n_null = 0 if null is None else int(null.sum())
    valid = None
    if null is not None and n_null:
        valid = pa.py_buffer(np.packbits(~null, bitorder="little"))
    return pa.Array.from_buffers(kind, n, [valid, pa.py_buffer(first), *more], null_count=n_null)
