"""Pickled dictionaries of arrays, read without running what a pickle can run.

A pickle is a program. This reader lets it name a few things only, and none of
them does anything: they note what the pickle wants to build, and the arrays are
built here, from plain bytes. So a file can hold numpy arrays and scalars of
numbers and strings, dictionaries, lists, tuples, numbers and strings - and any
other wish is refused by name. Even numpy's own unpickling is not called: the
state of a dtype could make it take bytes of the file for addresses.
"""

from __future__ import annotations

import io
import pickle
from collections.abc import Callable
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from zfcal.errors import InputError
from zfcal.readers.extras import whole

_PLAIN_KINDS = "biufSU"
_SCALARS = (bool, int, float, str, bytes, bytearray, type(None))


class _RefusedError(Exception):
    """A pickle asks for more than plain data."""


class _Wish:
    """Something that a pickle asks for: a name, what it was called with, and its state."""

    __slots__ = ("arguments", "name", "state")

    name: str
    arguments: tuple[Any, ...]
    state: Any

    def __init__(self, name: str, arguments: tuple[Any, ...]) -> None:
        object.__setattr__(self, "name", name)
        object.__setattr__(self, "arguments", arguments)
        object.__setattr__(self, "state", None)

    def __setattr__(self, name: str, value: object) -> None:
        raise _RefusedError(f"the file tries to set {name!r} of an object")

    def __setstate__(self, state: object) -> None:
        object.__setattr__(self, "state", state)

    def __call__(self, *arguments: object) -> _Wish:
        return _Wish(self.name, arguments)


_ADMITTED = {
    ("numpy", "ndarray"): "ndarray",
    ("numpy", "dtype"): "dtype",
    ("numpy.core.multiarray", "_reconstruct"): "array",
    ("numpy._core.multiarray", "_reconstruct"): "array",
    ("numpy.core.multiarray", "scalar"): "scalar",
    ("numpy._core.multiarray", "scalar"): "scalar",
    ("numpy.core.numeric", "_frombuffer"): "buffer",
    ("numpy._core.numeric", "_frombuffer"): "buffer",
    # How Python 3 writes bytes for a protocol that has none.
    ("_codecs", "encode"): "encode",
    ("__builtin__", "bytes"): "nothing",
    ("builtins", "bytes"): "nothing",
}


class _Unpickler(pickle.Unpickler):
    def find_class(self, module: str, name: str) -> Any:
        wish = _ADMITTED.get((module, name))
        if wish is None:
            raise _RefusedError(f"it refers to {module}.{name}")
        return _Wish(wish, ())


def read_npy(path: Path) -> Any:
    """Return what a ``.npy`` file holds: an array of numbers, or pickled objects made plain.

    Parameters
    ----------
    path
        As written by ``numpy.save``.

    Raises
    ------
    InputError
        The file is damaged, is no ``.npy`` file, or its pickle asks for
        anything but arrays, dictionaries, lists, tuples, numbers and strings.
    """
    with whole(path, ".npy"), path.open("rb") as file:
        return _read_npy(path, file)


def _read_npy(path: Path, file: BinaryIO) -> Any:
    version = np.lib.format.read_magic(file)
    reader = (
        np.lib.format.read_array_header_1_0
        if version == (1, 0)
        else np.lib.format.read_array_header_2_0
    )
    _, _, dtype = reader(file)
    if dtype.hasobject:
        return load_plain(path, file.read())
    file.seek(0)
    return np.lib.format.read_array(file, allow_pickle=False)


def load_plain(path: Path, data: bytes) -> Any:
    """Return the plain content of a pickle.

    Parameters
    ----------
    path
        Where the bytes come from, named in messages.
    data
        One pickle. An object array of a single element is taken out of it.
    """
    try:
        with whole(path, "pickled"):
            plain = _plain(_Unpickler(io.BytesIO(data), encoding="latin1").load(), {})
    except _RefusedError as error:
        raise InputError(
            f"{path}: expected arrays, dictionaries, lists, numbers and strings only; {error}.",
            hint="A pickle can run programs, so nothing else is read. Save plain arrays again.",
        ) from error
    if isinstance(plain, np.ndarray) and plain.dtype == object and plain.size == 1:
        return plain.item()
    return plain


def _plain(value: Any, done: dict[int, tuple[Any, Any]]) -> Any:
    """Build what is wished for; what occurs many times is built once."""
    if isinstance(value, _SCALARS):
        return value
    if id(value) in done:
        return done[id(value)][1]
    # A list that holds itself comes back here before it is done.
    done[id(value)] = (value, None)
    built: Any
    if isinstance(value, dict):
        built = {_plain(k, done): _plain(v, done) for k, v in value.items()}
    elif isinstance(value, list | tuple):
        built = type(value)(_plain(item, done) for item in value)
    elif isinstance(value, _Wish) and value.name in _BUILDERS:
        built = _BUILDERS[value.name](value, done)
    else:
        raise _RefusedError(f"it holds {type(value).__name__}")
    done[id(value)] = (value, built)
    return built


def _build_dtype(wish: _Wish, done: dict[int, tuple[Any, Any]]) -> np.dtype[Any]:
    """Return a dtype of numbers, strings or objects; its state may set the byte order only."""
    if not wish.arguments or not isinstance(wish.arguments[0], str):
        raise _RefusedError("it holds a dtype that is no plain one")
    dtype = np.dtype(wish.arguments[0])
    if dtype.kind not in _PLAIN_KINDS + "O":
        raise _RefusedError(f"it holds an array of {dtype}")
    if wish.state is None:
        return dtype
    order, *parts = _plain(wish.state, done)[1:5]
    if order not in {"<", ">", "|", "="} or any(part is not None for part in parts):
        raise _RefusedError("it holds a dtype that is no plain one")
    return dtype if order == "|" else dtype.newbyteorder(order)


def _build_array(wish: _Wish, done: dict[int, tuple[Any, Any]]) -> NDArray[Any]:
    _, shape, dtype, fortran, data = _plain(wish.state, done)
    return _array(data, dtype, shape, "F" if fortran else "C")


def _build_buffer(wish: _Wish, done: dict[int, tuple[Any, Any]]) -> NDArray[Any]:
    data, dtype, shape, order = _plain(wish.arguments, done)
    return _array(data, dtype, shape, order)


def _build_scalar(wish: _Wish, done: dict[int, tuple[Any, Any]]) -> Any:
    dtype, data = _plain(wish.arguments, done)
    return _array(data, dtype, (1,), "C")[0]


def _build_bytes(wish: _Wish, done: dict[int, tuple[Any, Any]]) -> bytes:
    text, encoding = _plain(wish.arguments, done)
    if encoding != "latin1" or not isinstance(text, str):
        raise _RefusedError(f"it has the encoding {encoding!r}")
    return text.encode("latin1")


def _build_nothing(wish: _Wish, done: dict[int, tuple[Any, Any]]) -> bytes:
    if _plain(wish.arguments, done):
        raise _RefusedError("it builds bytes of something")
    return b""


def _array(data: Any, dtype: Any, shape: Any, order: str) -> NDArray[Any]:
    if not isinstance(dtype, np.dtype):
        raise _RefusedError("it holds an array without a dtype")
    if dtype.hasobject:
        if not isinstance(data, list):
            raise _RefusedError("it takes bytes for objects")
        objects = np.empty(len(data), dtype=object)
        for place, item in enumerate(data):
            objects[place] = item
        return objects.reshape(shape)
    raw = data.encode("latin1") if isinstance(data, str) else data
    flat = np.frombuffer(raw, dtype=dtype) if len(raw) else np.empty(0, dtype=dtype)
    return flat.reshape(shape, order="F" if order == "F" else "C")


_BUILDERS: dict[str, Callable[[_Wish, dict[int, tuple[Any, Any]]], Any]] = {
    "array": _build_array,
    "buffer": _build_buffer,
    "dtype": _build_dtype,
    "encode": _build_bytes,
    "nothing": _build_nothing,
    "scalar": _build_scalar,
}
