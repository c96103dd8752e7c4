"""How kernels are compiled, and where they are kept between runs.

Numba looks only at a function's own file to see whether a kept version still
holds, so a change in a file that it calls would go unnoticed. Here the place
itself is named after all sources of the model. It is in the user's cache
folder, since an installed package may not be writable, or in the folder that
``NUMBA_CACHE_DIR`` names. Where neither can be written nothing is kept, and
every start compiles anew.

Compiling takes long, so the first time that it happens in a process it is
logged to `LOGGER`, which the command line shows.
"""

from __future__ import annotations

import hashlib
import logging
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeVar, final

import numba
from numba import cfunc, njit, types
from numba.core import event

F = TypeVar("F", bound=Callable[..., Any])

LOGGER = logging.getLogger(__name__)

_config: Any = numba.config
_Listener: Any = event.Listener
_type_of: Any = types.unliteral


def cache_folder() -> Path | None:
    """Return the folder for this very version of the model's sources; None without a home."""
    digest = hashlib.sha256()
    here = Path(__file__).parents[1]
    for path in sorted(here.rglob("*.py")):
        digest.update(f"{path.relative_to(here).as_posix()}\0".encode() + path.read_bytes())
    asked = os.environ.get("NUMBA_CACHE_DIR") or os.environ.get("XDG_CACHE_HOME")
    try:
        home = Path(asked) if asked else Path.home() / ".cache"
    except RuntimeError:
        return None
    return home / "zfcal" / f"kernels-{digest.hexdigest()[:16]}"


def keeps(folder: Path | None) -> bool:
    """Tell whether kernels can be kept in a folder, which is made if need be."""
    try:
        if folder is not None:
            folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        return False
    return folder is not None and os.access(folder, os.W_OK | os.X_OK)


def is_warm() -> bool:
    """Tell whether kernels were compiled before, so that a start takes no half minute."""
    return _folder is not None and KEPT and any(_folder.rglob("*.nbi"))


_folder = cache_folder()
KEPT = keeps(_folder)
"""Whether compiled kernels outlast the process."""


@contextmanager
def _kept_here() -> Iterator[None]:
    """Let what is compiled meanwhile be kept in the model's folder, and nothing else.

    Other kernels would be kept here or elsewhere, depending on what was imported first, and
    be compiled twice.
    """
    before = _config.CACHE_DIR
    _config.CACHE_DIR = str(_folder) if KEPT else before
    try:
        yield
    finally:
        _config.CACHE_DIR = before


@final
class Announcer(_Listener):  # type: ignore[misc]
    """Logs once that kernels are compiled; those that were kept are only loaded."""

    def __init__(self) -> None:
        self.told = False

    def on_start(self, event: Any) -> None:
        """Take the start of a compilation."""
        if event.data["dispatcher"].py_func.__module__.startswith("zfcal."):
            self.tell()

    def on_end(self, event: Any) -> None:
        """Take the end of a compilation."""

    def tell(self) -> None:
        """Log it, the first time."""
        if not self.told:
            self.told = True
            LOGGER.info(
                "Compiling the simulator takes about half a minute, longer on a busy machine. %s",
                "The next start finds it ready." if KEPT else "Every start will: nothing is kept.",
            )


_announcer = Announcer()
_register: Any = event.register
_register("numba:compile", _announcer)


def kernel(function: F) -> F:
    """Compile a function by itself."""
    with _kept_here():
        compiled: Any = njit(cache=KEPT, nogil=True, error_model="numpy")(function)
    return _for_all_values(compiled)


def lean(function: F) -> F:
    """Compile without reference counts, hence without new arrays, in all that it calls.

    Arrays that travel in tuples are otherwise counted at every call, which made
    a step three times as slow. Products and sums may be fused.
    """
    options: dict[str, Any] = {"fastmath": {"contract"}, "_nrt": False}
    with _kept_here():
        compiled: Any = njit(cache=KEPT, nogil=True, error_model="numpy", **options)(function)
    return _for_all_values(compiled)


def _for_all_values(compiled: Any) -> Any:
    """Let kernels that pass a constant take the version for all values of its type.

    Numba compiles a function once more for each constant that another one passes to it,
    and the step of all agents takes longer to compile than all else.
    """
    if _config.DISABLE_JIT:
        return compiled
    find = compiled.get_call_template

    def find_for_types(args: Any, named: Any) -> Any:
        plain = {name: _type_of(arg) for name, arg in named.items()}
        return find([_type_of(arg) for arg in args], plain)

    compiled.get_call_template = find_for_types
    return compiled


def inlined(function: F) -> F:
    """Make a function a part of its callers."""
    compiled: Any = njit(inline="always")(function)
    return compiled


def hook(signature: Any) -> Callable[[F], Any]:
    """Return what compiles an effect's function, to be called by its address.

    Parameters
    ----------
    signature
        One of `zfcal.model.kernels.hooks`.
    """
    if not is_warm():
        _announcer.tell()
    if _config.DISABLE_JIT:
        # Plain Python has no addresses; effects are tested compiled.
        return _Plain
    compiles: Any = cfunc(signature, cache=KEPT, error_model="numpy")

    def make(function: F) -> Any:
        with _kept_here():
            return compiles(function)

    return make


class _Plain:
    """An effect's function where the compiler is off: it can be named, and not be called."""

    address = 0

    def __init__(self, function: Callable[..., Any]) -> None:
        self.function = function
