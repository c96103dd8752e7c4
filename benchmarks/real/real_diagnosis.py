"""What the published model misses in real fish: the diagnosis of each real recording.

Imports each recording as `real_recordings` does, diagnoses it, and writes

    benchmarks/results/real_diagnosis.json    what was found
    docs/pictures/diagnosed-NAME.png          the first effect of a recording
    docs/real-diagnosis.md                    its table

    .venv/bin/python benchmarks/real/real_diagnosis.py --data ../shared/data --quick
    .venv/bin/python benchmarks/real/real_diagnosis.py --quick --again --only five

With ``--again`` what was found is added to the model, and the recording is diagnosed once more.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import sys
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from benchmarks.real.document import replaced
from benchmarks.real.real_recordings import PICTURES, prepare, shrink, zfcal
from benchmarks.real.recordings import SOURCES
from benchmarks.shared.measuring import DOCS, ROOT, table
from benchmarks.shared.measuring import RESULTS as FOLDER
from zfcal import __version__
from zfcal.errors import ZfcalError

RESULTS = FOLDER / "real_diagnosis.json"
DOCUMENT = DOCS / "real-diagnosis.md"
GENERATIONS = "3"
CLEAREST = 4
"""So many disagreements of single statistics are told of each recording."""


def diagnose(name: str, data: Path, work: Path, options: tuple[str, ...]) -> dict[str, Any]:
    """Return what the diagnosis says of a recording, with its first picture beside the others.

    Parameters
    ----------
    name
        A key of `recordings.SOURCES`.
    data, work
        Folder of the recordings and of the trials that are made.
    options
        More of ``zfcal diagnose``.
    """
    recording = SOURCES[name](data, work)
    places, _ = prepare(recording, work)
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    zfcal("diagnose", places.trial, *options)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    folder = places.trial / "diagnosis"
    findings = json.loads((folder / "findings.json").read_text(encoding="utf-8"))
    for picture in sorted(folder.glob("1-*.png")):
        target = PICTURES / f"diagnosed-{recording.name}.png"
        target.write_bytes(picture.read_bytes())
        shrink(target)
    return {
        "name": recording.name,
        "title": recording.title,
        "said": list(recording.said),
        "verdict": findings["verdict"],
        "minutes": findings["details"]["minutes"],
        "steps": findings["details"]["n_steps"],
        "effects": _effects(findings),
        "where": findings["where"][:CLEAREST],
        "notes": {note["name"]: note["says"] for note in findings["notes"]},
        "processor_s": after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime,
    }


def diagnose_again(name: str, work: Path, options: tuple[str, ...]) -> dict[str, Any]:
    """Return what the diagnosis says once the model has the effects that were found.

    Parameters
    ----------
    name
        A key of `recordings.SOURCES` that was diagnosed.
    work
        Folder of the trials.
    options
        More of ``zfcal diagnose``.
    """
    trial = work / name
    zfcal("extend", trial, "--generations", GENERATIONS)
    zfcal("diagnose", trial, "--model", trial / "models" / "extended.toml", *options)
    first, second = (
        json.loads((trial / "diagnosis" / place / "findings.json").read_text(encoding="utf-8"))
        for place in (".", "extended")
    )
    gap = {entry["measure"]: entry for entry in first["gap"]}["nats_per_step"]
    return {
        "verdict": second["verdict"],
        "effects": _effects(second),
        "closed": gap["closed"],
        "placebo": gap["placebo"],
    }


def _effects(findings: dict[str, Any]) -> list[dict[str, Any]]:
    """Return what is kept of the effects of a ``findings.json``."""
    kept = ("name", "says", "gain_nats_per_step", "p", "ties")
    return [{key: effect[key] for key in kept} for effect in findings["effects"]]


def _named(one: dict[str, Any]) -> str:
    """Return the effects of a diagnosis with what they gain, or its verdict."""
    effects = [
        f"{' or '.join([effect['name'], *effect['ties']])} ({effect['gain_nats_per_step']:.3f})"
        for effect in one["effects"]
    ]
    return "; ".join(effects) or str(one["verdict"])


def again_table(found: dict[str, dict[str, Any]]) -> str:
    """Return a row for each recording that was diagnosed twice."""
    rows = [
        [one["title"], _percent(then["closed"]), _percent(then["placebo"]), _named(then)]
        for one in found.values()
        if (then := one.get("again"))
    ]
    heads = ["recording", "gap closed", "placebo", "then missing (nats per step)"]
    return table(heads, rows)


def _percent(share: float | None) -> str:
    return "–" if share is None else f"{100 * share:.0f} %"


def found_table(found: dict[str, dict[str, Any]]) -> str:
    """Return a row for each recording: what it lacks, and how much that explains."""
    rows = [
        [one["title"], f"{one['minutes']:.0f} min", str(one["steps"]), _named(one)]
        for one in found.values()
    ]
    return table(["recording", "length", "steps", "missing (nats per step)"], rows)


def where_table(found: dict[str, dict[str, Any]]) -> str:
    """Return the clearest disagreements of each recording."""
    rows = []
    for one in found.values():
        for at, where in enumerate(one["where"]):
            rows.append([
                one["title"] if at == 0 else "",
                where["statistic"],
                where["zone"] or "anywhere",
                f"{where['observed']:.3g}",
                f"{where['expected']:.3g}",
                f"{where['z']:.0f}",
            ])  # fmt: skip
    return table(["recording", "statistic", "where", "fish", "model", "z"], rows)


def said_list(found: dict[str, dict[str, Any]]) -> str:
    """Return the effects in words."""
    lines = [
        f"- **{one['title']}**: " + " ".join(effect["says"] for effect in one["effects"])
        for one in found.values()
        if one["effects"]
    ]
    return "\n".join(lines)


def tables_of(found: dict[str, dict[str, Any]]) -> dict[str, str]:
    """Return the tables of the document, by the comments that they stand between."""
    return {
        "found": found_table(found),
        "again": again_table(found),
        "where": where_table(found),
        "said": said_list(found),
    }


def main() -> int:
    """Do it all; print the path of each file that is written."""
    options = _options()
    options.work.mkdir(parents=True, exist_ok=True)
    more = ("--quick",) if options.quick else ()
    known = json.loads(RESULTS.read_text(encoding="utf-8")) if RESULTS.is_file() else {}
    found = dict(known.get("recordings", {})) if options.only else {}
    for name in options.only or SOURCES:
        if not options.again:
            found[name] = diagnose(name, options.data, options.work, more)
        else:
            found[name]["again"] = diagnose_again(found[name]["name"], options.work, more)
        results = {
            "command": f"zfcal diagnose TRIAL {' '.join(more)}".strip(),
            "zfcal": __version__,
        }
        text = json.dumps({**results, "recordings": found}, indent=1, ensure_ascii=False)
        RESULTS.write_text(text + "\n", encoding="utf-8")
    text = replaced(DOCUMENT.read_text(encoding="utf-8"), tables_of(found))
    DOCUMENT.write_text(text, encoding="utf-8")
    print(RESULTS, DOCUMENT, sep="\n")
    return 0


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0] if __doc__ else None)
    data = os.environ.get("ZFCAL_SHARED_DATA", ROOT.parent / "shared" / "data")
    parser.add_argument("--data", type=Path, default=Path(data), help="folder of the recordings")
    parser.add_argument("--work", type=Path, default=ROOT / "trials-real", help="folder of trials")
    parser.add_argument("--quick", action="store_true", help="the theory alone as the null")
    parser.add_argument("--again", action="store_true", help="the second round, of one that was")
    parser.add_argument("--only", choices=SOURCES, nargs="+", help="these; the others stay")
    options = parser.parse_args()
    if not options.data.is_dir():
        parser.error(f"no recordings at {options.data}; --data names another place")
    return options


if __name__ == "__main__":
    try:
        sys.exit(main())
    except ZfcalError as error:
        sys.exit(f"error: {error}\n{error.hint}")
