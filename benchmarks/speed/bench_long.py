"""Measure every command on half an hour and on a day: processor time and largest memory.

Makes ``long.json`` and ``benchmarks-long.md``: in ``build/benchmarks``, with ``--write``
in ``benchmarks/results`` and ``docs``. The day is measured with ``--day``, and with ``--write``.

    .venv/bin/python benchmarks/speed/bench_long.py
    .venv/bin/python benchmarks/speed/bench_long.py --day
    .venv/bin/python benchmarks/speed/bench_long.py --before ../older-checkout

The commands are those of the installed package if that is this checkout.
With an older checkout every command is run by it as well, in turn, and what both have
made is compared byte by byte.
"""

from __future__ import annotations

import argparse
import os
import resource
import shutil
import subprocess
import sys
import tempfile
import textwrap
import time
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from benchmarks.shared.measuring import ROOT, keep, load, machine, table
from benchmarks.shared.regressions import BUILD, Ratio, conclude, parser, written
from zfcal.artifacts.reading.contents import sha256_of
from zfcal.artifacts.tables import read_tracks

LIMIT_S = 30
"""Processor time after which an older checkout is given up."""

NO_BYTES = frozenset({".lock-analyse", ".lock-report"})


@dataclass(frozen=True, slots=True, kw_only=True)
class Length:
    """A trial of four fish and a robot, simulated.

    Parameters
    ----------
    name
        What the table calls it.
    duration
        As `zfcal simulate` takes it.
    fps
        Frame rate, in hertz.
    imported
        Whether its tracks are imported from a CSV file, too.
    """

    name: str
    duration: str
    fps: int
    imported: bool = False


HALF_AN_HOUR = Length(name="half an hour at 15 Hz", duration="30min", fps=15, imported=True)
DAY = Length(name="a day at 3 Hz", duration="24h", fps=3)
TINY = (Length(name="three minutes at 15 Hz", duration="3min", fps=15, imported=True),)


@dataclass(frozen=True, slots=True, kw_only=True)
class Tree:
    """A checkout whose commands can be run, or what is installed.

    Parameters
    ----------
    path
        Where commands are run: a folder in which its packages lie under their installed names, or
        an empty one, in which those that are installed are found.
    limit_s
        Processor time that a command may take; None for any.
    """

    path: Path
    limit_s: int | None = None

    @classmethod
    def here(cls, folder: Path) -> Tree:
        """Take what is installed if it is this checkout: its kernels are compiled, as a user's are.

        Where it is another one, or none, this checkout is laid out.
        """
        source = "import pathlib, zfcal; print(pathlib.Path(zfcal.__file__).resolve().parents[1])"
        folder.mkdir()
        found = subprocess.run(
            [sys.executable, "-c", source], cwd=folder, capture_output=True, text=True, check=False
        )
        if found.stdout.strip() == str(ROOT):
            return cls(path=folder)
        folder.rmdir()
        return cls.of(ROOT, folder)

    @classmethod
    def of(cls, checkout: Path, folder: Path, limit_s: int | None = None) -> Tree:
        """Lay out a checkout in a folder of its own."""
        folder.mkdir()
        for name, source in (("zfcal", "zfcal"), ("zfcal_cli", "cli")):
            (folder / name).symlink_to(checkout.resolve() / source)
        return cls(path=folder, limit_s=limit_s)

    def run(self, *words: object) -> dict[str, float] | None:
        """Run a command as a process; return what it took, None if it was given up."""
        begin = time.perf_counter()
        line = [sys.executable, "-m", "zfcal_cli.main", *map(str, words), "-q"]
        limit = None if self.limit_s is None else (self.limit_s, self.limit_s + 5)
        bound = None if limit is None else partial(resource.setrlimit, resource.RLIMIT_CPU, limit)
        with subprocess.Popen(
            line,
            cwd=self.path,  # where Python looks first
            env={**os.environ, "PYTHONPATH": str(self.path)},
            stdout=subprocess.DEVNULL,
            preexec_fn=bound,  # noqa: PLW1509 - no thread runs here
        ) as process:
            _, status, used = os.wait4(process.pid, 0)
            process.returncode = os.waitstatus_to_exitcode(status)
        if process.returncode < 0 and self.limit_s is not None:
            return None
        if process.returncode:
            raise SystemExit(f"zfcal {' '.join(map(str, words))}: exit code {process.returncode}")
        return {
            "processor_s": used.ru_utime + used.ru_stime,
            "wall_s": time.perf_counter() - begin,
            "peak_mb": used.ru_maxrss / 1024,
        }


def write_csv(root: Path, path: Path) -> None:
    """Write the tracks of a trial as a CSV file."""
    with path.open("w", encoding="utf-8") as file:
        file.write("time_s,agent,x_m,y_m\n")
        for part in sorted((root / "tracks").glob("*.parquet")):
            tracks = read_tracks(part)
            rows = zip(tracks.time_s, tracks.agent, tracks.x_m, tracks.y_m, strict=True)
            file.writelines(f"{t:.6f},{a},{x:.6f},{y:.6f}\n" for t, a, x, y in rows)


def same_bytes(a: Path, b: Path) -> bool:
    """Return whether two folders hold the same files."""

    def hashes(folder: Path) -> dict[str, str]:
        files = (path for path in folder.rglob("*") if path.is_file())
        named = {path.relative_to(folder).as_posix(): path for path in files}
        return {name: sha256_of(path) for name, path in named.items() if name not in NO_BYTES}

    return hashes(a) == hashes(b)


def measure_length(length: Length, trees: dict[str, Tree], folder: Path) -> list[dict[str, Any]]:
    """Return a row per command on a trial of one length."""
    now, root = trees["now"], folder / "now" / "trial"
    tank = ("--arena", "two-rooms", "--fish", 4, "--robot", "--fps", length.fps)
    model = root / "models" / "000000.toml"
    swim = ("--model", model, "--duration", length.duration)
    now.run("init", root, *tank)
    # Whoever runs first may have to compile.
    now.run("simulate", folder / "warm", "--model", model, "--duration", "60s")
    rows = [{"command": "simulate", "now": now.run("simulate", root, *swim)}]
    places = {name: folder / name / "trial" for name in trees}
    for name in set(trees) - {"now"}:
        shutil.copytree(root, places[name])
    if length.imported:
        write_csv(root, folder / "tracks.csv")
        others = {name: folder / name / "imported" for name in trees}
        for place in others.values():
            now.run("init", place, *tank)
        source = (folder / "tracks.csv", "--format", "csv", "--robots", 4)
        words = {name: ("import", source[0], place, *source[1:]) for name, place in others.items()}
        rows.append(_row("import, from CSV", trees, words, others))
    rows += [
        _row("analyse", trees, {n: ("analyse", place) for n, place in places.items()}, places),
        _row("analyse again, nothing to do", trees, dict.fromkeys(trees, ("analyse", root))),
        _row("check", trees, dict.fromkeys(trees, ("check", root))),
        _row("inspect, the last scores", trees, {n: ("inspect", _last(root)) for n in trees}),
    ]
    how = ("--window", "0:120", "--generations", 0, "--workers", 1)
    words = {"now": ("calibrate", root, *how, "-o", folder / "model.toml")}
    now.run("calibrate", root, *how, "-o", folder / "warm.toml")
    rows.append(_row("calibrate, a window, no generation", {"now": now}, words))
    pages = {name: folder / name / "report" for name in trees}
    words = {n: ("report", root, "-o", place) for n, place in pages.items()}
    return [*rows, _row("report", trees, words, pages)]


def _last(root: Path) -> Path:
    return max((root / "scores").glob("*.parquet"))


def _row(
    command: str,
    trees: dict[str, Tree],
    words: dict[str, Sequence[object]],
    made: dict[str, Path] | None = None,
) -> dict[str, Any]:
    """Run a command by every tree in turn; compare what they have made."""
    row: dict[str, Any] = {"command": command}
    for name, tree in trees.items():
        row[name] = tree.run(*words[name])
    if made is not None and len(trees) > 1 and None not in row.values():
        row["same_bytes"] = same_bytes(*made.values())
    print(row, file=sys.stderr)
    return row


def measure(lengths: Sequence[Length], before: Path | None, results: Path) -> dict[str, Any]:
    """Measure trials of every length; what is known is kept after each."""
    found: dict[str, Any] = {"machine": machine(), "load_before": load(), "limit_s": LIMIT_S}
    with tempfile.TemporaryDirectory() as folder:
        here = Path(folder) / "tree-now"
        if before is None:
            trees = {"now": Tree.here(here)}
        else:
            older = Tree.of(before, Path(folder) / "tree-before", LIMIT_S)
            trees = {"before": older, "now": Tree.of(ROOT, here)}
        found["lengths"] = []
        for number, length in enumerate(lengths):
            place = Path(folder) / f"length-{number}"
            rows = measure_length(length, trees, place)
            found["lengths"].append({"name": length.name, "rows": rows})
            found["load_after"] = load()
            keep("long", found, results=results)
    return found


def markdown(found: dict[str, Any]) -> str:
    """Return the tables of what was measured."""
    compared = any("before" in row for each in found["lengths"] for row in each["rows"])
    said = f"""Made by `benchmarks/speed/bench_long.py`; numbers in `benchmarks/results/long.json`.
        Machine: {found["machine"]}; load {found["load_before"]:.1f} before,
        {found["load_after"]:.1f} after. Trials of four fish and a robot. Processor time with
        start-up, and the largest memory, of one command as a process; on a busy machine the
        times vary by a third."""
    if compared:
        said += f""" *Before* is an older checkout, run in turn with this one; what
            takes it more than {found["limit_s"]} s was given up. *Same bytes*: both have written
            the same files."""
    parts = ["# Half an hour and a day\n", textwrap.fill(" ".join(said.split()), 120) + "\n"]
    for each in found["lengths"]:
        parts.append(f"## {each['name'][:1].upper()}{each['name'][1:]}\n")
        parts += [textwrap.fill(each["note"], 120) + "\n"] if "note" in each else []
        parts.append(_table(each, compared))
    return "\n".join(parts)


def _table(each: dict[str, Any], compared: bool) -> str:  # noqa: FBT001 - of one caller
    head = ["command", "processor time (s)", "largest memory (MB)"]
    if compared:
        head += ["time before (s)", "memory before (MB)", "same bytes"]
    rows = []
    for row in each["rows"]:
        cells: list[object] = [row["command"], row["now"]["processor_s"], row["now"]["peak_mb"]]
        if compared:
            old = row.get("before", {})
            gone = ["given up", ""] if old is None else [old.get("processor_s", ""), ""]
            cells += gone if not old else [old["processor_s"], old["peak_mb"]]
            cells.append({True: "yes", False: "NO"}.get(row.get("same_bytes"), ""))  # type: ignore[arg-type]
        rows.append([round(cell) if _is_memory(cell) else cell for cell in cells])
    return table(head, rows)


def _is_memory(cell: object) -> bool:
    return isinstance(cell, float) and cell >= 100


def ratios(found: dict[str, Any]) -> dict[str, Ratio]:
    """Return time and memory of every command over those of the first one of the same length.

    That is the import, or the simulation where nothing was imported.
    """
    made = {}
    for each in found["lengths"]:
        rows = {row["command"]: row["now"] for row in each["rows"]}
        base = next(name for name in ("import, from CSV", "simulate") if name in rows)
        for what, key in (("time", "processor_s"), ("memory", "peak_mb")):
            for command, row in rows.items():
                if command not in {base, "simulate"}:
                    name = f"{each['name']}, {what}: {command} over {base}"
                    made[name] = Ratio(value=row[key] / rows[base][key])
    return made


def lengths_of(options: argparse.Namespace) -> tuple[Length, ...]:
    """Return what is measured with these options."""
    if options.tiny:
        return TINY
    return (HALF_AN_HOUR, DAY) if options.day or options.write else (HALF_AN_HOUR,)


def main() -> None:
    """Measure, or read again what was measured, write both files, and compare."""
    options_of = parser(__doc__)
    options_of.add_argument("--day", action="store_true", help="Measure a day, too.")
    options_of.add_argument("--draw", action="store_true", help="Measure nothing; read the JSON.")
    options_of.add_argument("--before", type=Path, help="An older checkout to compare with.")
    options = options_of.parse_args()
    if options.draw:
        found = written("long", options)
    else:
        # The committed results stay as they are until they have been compared with.
        found = measure(lengths_of(options), options.before, options.out or BUILD)
    conclude("long", found, markdown(found), ratios=ratios, options=options)


if __name__ == "__main__":
    main()
