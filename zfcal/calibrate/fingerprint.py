"""What the numbers of a simulation depend on besides genes and seeds: sources and machine.

Two computers with equal fingerprints count the same, bit for bit. Where only the
machines differ, `trace` tells whether it matters.
"""

from __future__ import annotations

import hashlib
import platform
from dataclasses import dataclass, fields
from functools import lru_cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from numba.core.registry import cpu_target

import zfcal.model.simulate as simulation
from zfcal.arena import Arena, make_arena
from zfcal.errors import InputError
from zfcal.parameters import Parameters, natural

_PACKAGES = ("zfcal", "numpy", "numba", "llvmlite", "shapely")
_SOURCES = ("model", "arena.py", "parameters.py", "units.py")
_DIGITS = 12


def _digest(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()[:_DIGITS]


def _sources() -> str:
    package = Path(simulation.__file__).parents[1]
    parts = []
    for name in _SOURCES:
        place = package / name
        for path in sorted(place.rglob("*.py")) if place.is_dir() else [place]:
            parts += [path.relative_to(package).as_posix().encode(), path.read_bytes()]
    return _digest(b"\0".join(parts))


_AT_IMPORT = _sources()
"""Taken once: whoever exchanges the files later does not change a process that runs."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Fingerprint:
    """The programs that a simulation runs through, and the processor that they run on.

    Parameters
    ----------
    zfcal, numpy, numba, llvmlite, shapely
        Versions.
    sources
        Digest of the sources of the model, the arena and the parameters.
    machine
        Digest of the processor, as the compiler sees it, and of the C library.
    """

    zfcal: str
    sources: str
    numpy: str
    numba: str
    llvmlite: str
    shapely: str
    machine: str

    def unlike(self, other: Fingerprint) -> list[str]:
        """Return the names in which two programs differ; the machine is left aside."""
        names = [field.name for field in fields(self) if field.name != "machine"]
        return [name for name in names if getattr(self, name) != getattr(other, name)]

    def told(self, names: list[str]) -> str:
        """Return some of the fields as people read them."""
        return ", ".join(f"{name} {getattr(self, name)}" for name in names)


@lru_cache(maxsize=1)
def fingerprint() -> Fingerprint:
    """Return the fingerprint of this process."""
    return Fingerprint(
        **{name: _version(name) for name in _PACKAGES}, sources=_AT_IMPORT, machine=_machine()
    )


@lru_cache(maxsize=1)
def trace() -> str:
    """Return a digest of where a few agents of a short simulation were, to the last bit.

    The first call of a new installation compiles for some twenty seconds.
    """
    model, arena = _square()
    path_m, heading_rad = simulation.simulate_tracks(model, arena, n_agents=5, n_steps=200, seed=1)
    return _digest(path_m.tobytes() + heading_rad.tobytes())


def warm_up() -> None:
    """Have this process compile, or load, what counts simulations."""
    model, arena = _square()
    packed, seeds = simulation.pack([model], arena), np.zeros(1, dtype=np.uint64)
    simulation.simulate_counts(packed, arena, n_agents=2, n_steps=1, seeds=seeds, n_threads=1)


def _square() -> tuple[Parameters, Arena]:
    """Return a model and the tank that it swims in, for simulations of no other use."""
    arena = make_arena(name="square", outline=shapely.box(0.0, 0.0, 0.4, 0.4), wall_zone_m=0.05)
    zones = tuple((zone.name, zone.follows_walls) for zone in arena.zones)
    return natural(zones, dt_s=0.2), arena


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return "unknown"


def _machine() -> str:
    target: Any = cpu_target
    compiler = target.target_context.codegen().magic_tuple()
    return _digest(repr((compiler, platform.libc_ver())).encode())


def refuse_unlike(here: Fingerprint, there: Fingerprint | Exception, worker: str) -> None:
    """Raise an `InputError` unless a worker runs the same programs as this process.

    Parameters
    ----------
    here, there
        Fingerprints of this process and of the worker, or what went wrong there.
    worker
        Its address.
    """
    hint = "Install the same version on every computer and restart the workers."
    if not isinstance(there, Fingerprint):
        raise InputError(f"Worker {worker} cannot load zfcal {here.zfcal}: {there}", hint=hint)
    if names := here.unlike(there):
        raise InputError(
            f"Worker {worker} has {there.told(names)}; here it is {here.told(names)}.", hint=hint
        )


def refuse_other_bits(there: str, worker: str) -> None:
    """Raise an `InputError` if a worker's processor makes other numbers than this one's.

    Parameters
    ----------
    there
        Its `trace`.
    worker
        Its address.
    """
    if there != trace():
        raise InputError(
            f"Worker {worker} computes otherwise: its processor or its C library differs, and a "
            f"short simulation ends in {there} there, in {trace()} here.",
            hint="Leave it out, or set NUMBA_CPU_NAME=generic for zfcal and for all workers.",
        )
