"""Compiled kernels are kept where a change of any source of the model cannot be missed."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import numba
import pytest

from zfcal.model.kernels import compiled

_REPORT = """
import numpy as np
from zfcal.model.kernels import compiled
from zfcal.model.kernels.random import seeded
print(compiled.KEPT, compiled.is_warm(), int(seeded(np.uint64(1))[0]), compiled.is_warm())
"""


@compiled.kernel
def _times(number, twice):
    return 2 * number if twice else number


@compiled.kernel
def _with_constants():
    return _times(3, True) + _times(4, False) + _times(5, True)


def report(tmp_path, **environment):
    """Compile one kernel in a process of its own; return what it says of what is kept."""
    kept = {k: v for k, v in os.environ.items() if k not in {"NUMBA_CACHE_DIR", "XDG_CACHE_HOME"}}
    done = subprocess.run(
        [sys.executable, "-B", "-c", _REPORT],
        env={**kept, "NUMBA_DISABLE_JIT": "0", **environment},
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=True,
    )
    return done.stdout.split()


_PLACES = """
import sys
from importlib import import_module
for name in sys.argv[1:]:
    import_module(name)
from zfcal.model.kernels.random import seeded
from zfcal.tracking._kernels import moments
print(seeded._cache._cache_path, moments._cache._cache_path)
"""


@pytest.fixture
def copied(tmp_path, monkeypatch):
    """Return a copy of the model's sources, of which the module takes itself for a part."""
    package = Path(compiled.__file__).parents[1]
    ignored = shutil.ignore_patterns("__pycache__")
    copy = shutil.copytree(package, tmp_path / "model", ignore=ignored)
    monkeypatch.setattr(compiled, "__file__", str(copy / "kernels" / "compiled.py"))
    return copy


@pytest.mark.parametrize(
    "name", ["kernels/random.py", "kernels/geometry.py", "effects/alignment.py"]
)
def test_a_change_of_any_source_leads_to_another_folder(name, copied):
    """Of the generator, which run.py only inlines; of the geometry; of an effect."""
    before = compiled.cache_folder()
    source = copied / name
    source.write_text(source.read_text() + "\n")

    assert compiled.cache_folder() != before
    source.write_text(source.read_text()[:-1])
    assert compiled.cache_folder() == before


def test_another_effect_leads_to_another_folder(copied):
    """A file that is new counts as well, and so does its name."""
    folders = [compiled.cache_folder()]
    new = copied / "effects" / "new.py"
    new.write_text("")
    folders.append(compiled.cache_folder())
    new.rename(new.with_name("newer.py"))
    folders.append(compiled.cache_folder())

    assert len(set(folders)) == 3


def test_the_folder_is_that_of_the_user_unless_asked_otherwise(monkeypatch, tmp_path):
    """NUMBA_CACHE_DIR before XDG_CACHE_HOME before ~/.cache; the sources' digest in each."""
    for name in ("NUMBA_CACHE_DIR", "XDG_CACHE_HOME"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    folders = [compiled.cache_folder()]
    for name in ("XDG_CACHE_HOME", "NUMBA_CACHE_DIR"):
        monkeypatch.setenv(name, str(tmp_path / name))
        folders.append(compiled.cache_folder())

    places = [tmp_path / "home" / ".cache", tmp_path / "XDG_CACHE_HOME"]
    places.append(tmp_path / "NUMBA_CACHE_DIR")
    assert [folder.parent.parent for folder in folders] == places
    assert len({folder.name for folder in folders}) == 1


def test_without_a_home_there_is_no_folder(monkeypatch):
    """A container may run under a number that nobody has: no traceback at import."""

    def homeless():
        raise RuntimeError("Could not determine home directory.")

    for name in ("NUMBA_CACHE_DIR", "XDG_CACHE_HOME"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(compiled.Path, "home", homeless)

    assert compiled.cache_folder() is None
    assert not compiled.keeps(None)


def test_a_folder_that_cannot_be_made_keeps_nothing(tmp_path):
    """A file stands in the way, as a read-only disk would."""
    (tmp_path / "file").write_text("")

    assert not compiled.keeps(tmp_path / "file" / "kernels")
    assert compiled.keeps(tmp_path / "folder" / "kernels")


@pytest.mark.slow
def test_kernels_are_kept_and_a_second_start_is_warm(tmp_path):
    """Cold before the first kernel, warm after it, and in the next process at once."""
    first, second = (report(tmp_path, XDG_CACHE_HOME=str(tmp_path)) for _ in range(2))

    assert (first[0], first[1], first[3]) == ("True", "False", "True")
    assert second[:2] == ["True", "True"]
    assert first[2] == second[2]


def test_other_kernels_keep_their_place_whoever_comes_first(tmp_path):
    """The tracker's stand beside their source, the model's in its folder, in either order."""
    names = ["zfcal.model.kernels.compiled", "zfcal.tracking._kernels"]
    kept = {k: v for k, v in os.environ.items() if k not in {"NUMBA_CACHE_DIR", "XDG_CACHE_HOME"}}
    places = [
        subprocess.run(
            [sys.executable, "-c", _PLACES, *order],
            env={**kept, "XDG_CACHE_HOME": str(tmp_path)},
            capture_output=True,
            text=True,
            check=True,
        ).stdout.split()
        for order in (names, names[::-1])
    ]
    assert places[0] == places[1]
    assert places[0][0].startswith(str(tmp_path / "zfcal"))
    assert "kernels-" not in places[0][1]


def test_where_nothing_can_be_written_kernels_run_all_the_same(tmp_path):
    """The cache folder's place is a file: compiled anew, never warm, the same numbers."""
    (tmp_path / "file").write_text("")

    kept, before, word, after = report(tmp_path, XDG_CACHE_HOME=str(tmp_path / "file"))

    assert (kept, before, after) == ("False", "False", "False")
    assert int(word) == 0x910A2DEC89025CC1  # SplitMix64 of seed 1


@pytest.mark.skipif(numba.config.DISABLE_JIT, reason="there are no versions without the compiler")
def test_a_constant_argument_is_no_version_of_its_own():
    """Three calls with constants of the same types: one version, for numbers of that type."""
    _with_constants.recompile()

    assert _with_constants() == 20
    assert _times.signatures == [(numba.int64, numba.boolean)]
