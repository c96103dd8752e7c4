"""Hide effects in trials, diagnose them, and count how often the diagnosis is right.

Trials that are done stay in ``build/bench-diagnosis``, a line each; a second run does what is
missing, or what was done by other code. The summary goes to ``build/benchmarks``, with
``--write`` to ``benchmarks/results`` and ``docs``: with every trial, from which a run on another
machine goes on.

    .venv/bin/python benchmarks/diagnosis/bench_diagnosis.py --workers 2
    .venv/bin/python benchmarks/diagnosis/bench_diagnosis.py --quick --minutes 60
    .venv/bin/python benchmarks/diagnosis/bench_diagnosis.py --report
"""

from __future__ import annotations

import argparse
import itertools
import multiprocessing
import os
import sys
import time
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from benchmarks.diagnosis import figures, film, ledger, trial
from benchmarks.diagnosis.document import MODES, as_json, markdown
from benchmarks.diagnosis.plan import (
    EXTEND,
    LISTED_SECTION,
    SECTIONS,
    TIME,
    VIDEO,
    Job,
    Scale,
    plan,
)
from benchmarks.diagnosis.summary import summarise
from benchmarks.shared.measuring import RESULTS, ROOT, machine
from benchmarks.shared.regressions import Places, parser, places

BUILD = ROOT / "build" / "bench-diagnosis"
PACKED = "diagnosis-trials.jsonl.gz"

_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


@dataclass(frozen=True, slots=True, kw_only=True)
class Desk:
    """Where trials are kept, and by which code.

    Parameters
    ----------
    folder
        One ledger for each section.
    marks
        Fingerprint of the code of each section.
    packed
        Trials of all sections that were made elsewhere.
    """

    folder: Path
    marks: dict[str, str]
    packed: Sequence[ledger.Row] = ()

    def rows(self, section: str, marks: Mapping[str, str] | None = None) -> dict[str, ledger.Row]:
        """Return the rows of a section that the present code has made, or another, by key."""
        return ledger.current(self.all_rows(section), marks or self.marks)

    def all_rows(self, section: str) -> list[ledger.Row]:
        """Return the rows of a section that any code has made."""
        made = [row for row in self.packed if row["section"] == section]
        return made + ledger.read(self.folder / f"{section}.jsonl")

    def marks_of(self, *, quick: bool) -> dict[str, str]:
        """Return the fingerprints of the code whose trials of a mode are told.

        They are those of the present code. Where that has made no trial of the mode, they are
        those by which most trials of each section were made.
        """
        made = {
            section: [row["code"] for row in self.all_rows(section) if row["quick"] is quick]
            for section in SECTIONS
        }
        if any(self.marks[section] in codes for section, codes in made.items()):
            return {section: self.marks[section] for section in SECTIONS}
        usual = {section: Counter(codes).most_common(1) for section, codes in made.items()}
        return {
            section: most[0][0] if most else self.marks[section] for section, most in usual.items()
        }

    def n_stale(self, section: str, rows: Sequence[ledger.Row]) -> int:
        """Return how many rows of a section here were made by other code than those that count."""
        counted = {(row["code"], row["quick"]) for row in rows if row["section"] == section}
        made = ledger.read(self.folder / f"{section}.jsonl")
        return sum((row["code"], row["quick"]) not in counted for row in made)

    def keep(self, section: str, row: ledger.Row) -> None:
        """Keep a row."""
        stamped = {"section": section, **row, "code": self.marks[section]}
        ledger.append(self.folder / f"{section}.jsonl", stamped)


def missing(jobs: Sequence[Job], desk: Desk, sections: Sequence[str]) -> list[Job]:
    """Return the trials that are still to be made; those that failed are tried again."""
    done = {
        key
        for section in sections
        for key, row in desk.rows(section).items()
        if row["verdict"] != "error"
    }
    return [
        job for job in jobs if job.section in sections and ledger.key_of(job.said()) not in done
    ]


def work(jobs: Sequence[Job], desk: Desk, *, workers: int, deadline_s: float) -> None:
    """Make trials side by side, and keep each when it is done.

    Parameters
    ----------
    jobs
        In the order in which they begin.
    desk
        Where they are kept.
    workers
        Processes.
    deadline_s
        On the monotonic clock: none begins later.
    """
    known = {row["key"]: row["nats"] for row in desk.rows(trial.ORACLE).values()}
    todo, running = iter(jobs), dict[Future[ledger.Row], Job]()
    count = itertools.count(1)
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(workers, mp_context=context, initializer=trial.warm_up) as pool:
        while True:
            for job in _next(todo, workers - len(running), deadline_s):
                nats = known.get(_oracle_key(job))
                run = film.run if job.section == VIDEO else trial.run
                running[pool.submit(run, job, nats)] = job
            if not running:
                return
            done, _ = wait(running, return_when=FIRST_COMPLETED)
            for future in done:
                job, row = running.pop(future), future.result()
                _keep(desk, job, row, known)
                print(f"{next(count)}/{len(jobs)} {_line(job, row)}", file=sys.stderr, flush=True)


def _next(todo: Iterator[Job], n: int, deadline_s: float) -> list[Job]:
    return list(itertools.islice(todo, n)) if time.monotonic() < deadline_s else []


def _oracle_key(job: Job) -> str:
    return ledger.key_of(trial.oracle_said(job.scenario))


def _keep(desk: Desk, job: Job, row: ledger.Row, known: dict[str, Any]) -> None:
    key = _oracle_key(job)
    if row.get("nats") and key not in known:
        known[key] = row["nats"]
        said = trial.oracle_said(job.scenario)
        desk.keep(trial.ORACLE, {"key": key, "scenario": said, "nats": row["nats"]})
    desk.keep(job.section, row)


def _line(job: Job, row: ledger.Row) -> str:
    nats = f", {row['nats']['total']:.0f} nats" if row.get("nats") else ""
    names = " + ".join("/".join([e["name"], *e["ties"]]) for e in row["effects"])
    mode = "quick" if job.quick else "full"
    said = row.get("error") or f"{row['verdict']} {names}".strip()
    return (
        f"{job.section}, {job.kind}, seed {job.scenario['seed']}{nats}, {mode}: {said} "
        f"({row.get('cpu_s', 0):.0f} s, in all {row['all_s']:.0f} s)"
    )


def told(desk: Desk) -> list[ledger.Row]:
    """Return the rows of both modes that the document counts."""
    marks = {quick: desk.marks_of(quick=quick) for quick in (True, False)}
    return [
        row
        for quick, codes in marks.items()
        for section in SECTIONS
        for row in desk.rows(section, codes).values()
        if row["quick"] is quick
    ]


def summary(desk: Desk, jobs: Sequence[Job]) -> dict[str, Any]:
    """Return all numbers that the trials give; each mode says by which code they were made."""
    marks = {mode: desk.marks_of(quick=mode == "quick") for mode in MODES}
    rows = told(desk)
    planned = {section: sum(job.section == section for job in jobs) for section in SECTIONS}
    made = summarise(rows, planned=planned)
    return {
        "machine": machine(),
        "seeds": _ends([row["scenario"]["seed"] for row in rows]),
        "code": {
            mode: {"diagnosis": each[LISTED_SECTION], "extension": each[EXTEND]}
            for mode, each in marks.items()
        },
        **made,
    }


def _ends(seeds: Sequence[int]) -> list[int]:
    return [min(seeds), max(seeds)] if seeds else []


def publish(found: dict[str, Any], place: Places) -> None:
    """Write the JSON, the document and its figures, and say where they are."""
    for folder in (place.results, place.docs):
        folder.mkdir(parents=True, exist_ok=True)
    numbers = place.results / "diagnosis.json"
    numbers.write_text(as_json(found), encoding="utf-8")
    figures.draw(found, place.docs / "pictures")
    document = place.docs / "benchmarks-diagnosis.md"
    document.write_text(markdown(found), encoding="utf-8")
    print(f"{numbers}\n{document}")


def options_of(words: Sequence[str] | None = None) -> argparse.Namespace:
    """Return what the command line asks for."""
    made = parser(__doc__, tiny=False)
    add = made.add_argument
    add("--workers", type=int, default=2, help="trials at the same time")
    add("--quick", action="store_true", help="take the null of theory, not of 39 replicates")
    add("--sections", nargs="+", choices=SECTIONS, default=SECTIONS, help="these alone")
    add("--minutes", type=float, default=float("inf"), help="begin no trial after so long")
    add("--report", action="store_true", help="make no trial; summarise those that are there")
    add("--build", type=Path, default=BUILD, help="where finished trials are kept")
    says = "packed trials that count as well, in place of those stored with the results"
    add("--stored", type=Path, default=RESULTS / PACKED, metavar="FILE", help=says)
    for each in fields(Scale):
        add(f"--{each.name}", type=int, default=each.default, help="trials, see plan.py")
    return made.parse_args(words)


def main() -> None:
    """Make the trials that are missing, then write what all of them say."""
    options = options_of()
    # Trials run side by side in processes of their own, whose libraries get by with a thread.
    for name in _THREADS:
        os.environ.setdefault(name, "1")
    from hidden.effects import LISTED, UNLISTED
    from hidden.further import FURTHER

    if not options.stored.exists():
        sys.exit(f"--stored {options.stored}: there is no such file.")
    scale = Scale(**{each.name: getattr(options, each.name) for each in fields(Scale)})
    jobs = plan(scale, LISTED, UNLISTED, tuple(FURTHER), quick=options.quick)
    desk = Desk(
        folder=options.build,
        marks={**trial.marks(SECTIONS), VIDEO: film.mark()},
        packed=ledger.read(options.stored),
    )
    deadline_s = time.monotonic() + 60 * options.minutes
    todo = [] if options.report else missing(jobs, desk, options.sections)
    alone = [job for job in todo if job.section == TIME]
    together = [job for job in todo if job.section != TIME]
    for part, workers in ((alone, 1), (together, options.workers)):
        if part:
            work(part, desk, workers=workers, deadline_s=deadline_s)
    full = plan(Scale(), LISTED, UNLISTED, tuple(FURTHER), quick=options.quick)
    place = places(options)
    publish(summary(desk, full), place)
    rows = told(desk)
    ledger.pack(place.results / PACKED, [*rows, *desk.rows(trial.ORACLE).values()])
    if stale := sum(desk.n_stale(section, rows) for section in SECTIONS):
        print(f"{stale} trials were made by other code and do not count.", file=sys.stderr)


if __name__ == "__main__":
    main()
