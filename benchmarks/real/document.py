"""The tables of ``docs/real-recordings.md``, from the numbers in ``benchmarks/results``.

The words around the tables are written by people; a table stands between two comments
that name it and is replaced whole.

    .venv/bin/python benchmarks/real/document.py
"""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from benchmarks.shared.measuring import DOCS
from benchmarks.shared.measuring import RESULTS as FOLDER

RESULTS = FOLDER / "real_recordings.json"
DOCUMENT = DOCS / "real-recordings.md"

DIGITS = 4

Found = dict[str, dict[str, Any]]


def table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a table in Markdown."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def share(value: float | None) -> str:
    """Return a share as per cent, with a dash for none."""
    return "–" if value is None else f"{100 * value:.1f} %"


def score(value: float | None, digits: int = 3) -> str:
    """Return a score or a length, with a dash for none."""
    return "–" if value is None else f"{value:.{digits}f}"


def recordings(found: Found) -> str:
    """Return what was imported."""
    head = ["recording", "length", "positions of fish", "guessed", "at the wall", "void"]
    rows = []
    for one in found.values():
        p = one["positions"]
        rows.append([
            one["title"], f"{p['duration_s']:.0f} s", f"{p['positions_of_fish']}",
            share(p["guessed_share_of_fish"]), share(p["settled_share"]), share(p["void_share"]),
        ])  # fmt: skip
    return table(head, rows)


def scores(found: Found) -> str:
    """Return what models score on the held-out half."""
    head = [
        "recording", "start", "own speeds", "likelihood", "**calibrated**", "ceiling",
        "against it", "first half (data)",
    ]  # fmt: skip
    rows = []
    for one in found.values():
        h, after = one["held_out"], one["held_out"]["after"]
        low, high = score(after["ceiling_low"]), score(after["ceiling_high"])
        rows.append([
            one["title"], score(h["before"]["S"]), score(h["own_speeds"]["S"]),
            score(h.get("likelihood", {}).get("S")), f"**{score(after['S'])}**",
            f"{score(after['ceiling'])} ({low} to {high})", score(after["against_ceiling"], 2),
            score(one["without_model"]["halves"]["S"]),
        ])  # fmt: skip
    return table(head, rows)


def features(found: Found) -> str:
    """Return the features that the calibrated model misses, before and after."""
    head = ["recording", "D", "W", "O", "T"]
    rows = []
    for one in found.values():
        before, after = (one["held_out"][key]["features"] for key in ("before", "after"))
        cells = (_both(score(before.get(f"I_{f}")), score(after.get(f"I_{f}"))) for f in "DWOT")
        rows.append([one["title"], *cells])
    return table(head, rows)


def statistics(found: Found) -> str:
    """Return means of the statistics, zone by zone, of both halves."""
    head = ["recording", "zone", "time", "pair distance", "to the wall", "speed", "stays"]
    rows = []
    for one in found.values():
        halves = [one["statistics"][key] for key in ("first_half", "second_half")]
        for z, zone in enumerate(halves[0]["zones"]):
            cells = zip(*(_of_zone(half, z) for half in halves), strict=True)
            rows.append([one["title"] if z == 0 else "", zone, *(_both(*pair) for pair in cells)])
    return table(head, rows)


def guesses(found: Found) -> str:
    """Return what changes when guessed positions are left out."""
    head = [
        "recording", "left out", "pairs lost", "steps lost", "pair distance", "D", "W", "O", "T",
        "S", "S of the model",
    ]  # fmt: skip
    rows = []
    for one in found.values():
        c, whole = one["certain"], one["without_model"]["mean_pair_distance_m"]
        rows.append([
            one["title"], share(c["lost_positions"]), share(c["lost_pairs"]),
            share(c["lost_steps"]), _both(_mm(whole), _mm(c["mean_pair_distance_m"])),
            *(score(c["alike"][key], 2) for key in ("D", "W", "O", "T", "S")),
            f"{score(one['held_out']['after']['S'])} → {score(c['after_S'])}",
        ])  # fmt: skip
    return table(head, rows)


def control(found: Found) -> str:
    """Return how alike the groups in the ring are to fish alone."""
    head = [
        "recording", "mean pair distance", "D, run six", "D, run three", "D, both",
        "D with robot, windows", "S, both",
    ]  # fmt: skip
    rows = []
    for one in found.values():
        if "against_fish_alone" not in one:
            continue
        a = one["against_fish_alone"]
        groups = ("ring-fish-only-six", "ring-fish-only-three", "both")
        by_group = [score(a[g]["fish"]["D"]) if g in a else "–" for g in groups]
        w = a.get("windows")
        windows = f"{score(w['D_mean'])} ± {score(w['D_sd'])} ({w['n']})" if w else "–"
        total = score(a["both"]["fish"]["S"]) if "both" in a else "–"
        rows.append([one["title"], _mm(a["mean_pair_distance_m"]), *by_group, windows, total])
    return table(head, rows)


def robots(found: Found) -> str:
    """Return how fish-like each robot moves."""
    head = ["recording", "S", "a fish in its place", "against it", "D", "W", "O", "T"]
    rows = []
    for one in found.values():
        if "robot" not in one:
            continue
        r = one["robot"]
        total = r["S"]
        rows.append([
            one["title"], score(total["value"]),
            f"{score(total['ceiling'])} ({score(total['low'])} to {score(total['high'])})",
            score(total["value"] / total["ceiling"], 2),
            *(f"{score(r[f]['value'])} of {score(r[f]['ceiling'])}" for f in "DWOT"),
        ])  # fmt: skip
        if "robot_in_file" in one:
            other = one["robot_in_file"]
            against = score(other["S"] / other["ceiling"], 2)
            title = f"the same, were column {other['agent']} the robot"
            rows.append([title, score(other["S"]), score(other["ceiling"]), against, *"––––"])
    return table(head, rows)


def columns(found: Found) -> str:
    """Return which column is the robot's: the one that the tracker hardly ever lost."""
    head = [
        "recording", "column in the file", "column taken", "its guessed positions",
        "of the others", "its time in the middle", "of the others",
    ]  # fmt: skip
    rows = []
    for one in found.values():
        facts = one["facts"]
        if facts.get("robot_column") is None:
            continue
        taken = facts["robot_column"]
        cells = []
        for key in ("guessed_share", "middle_share"):
            rest = [value for at, value in enumerate(facts[key]) if at != taken]
            cells += [share(facts[key][taken]), f"{share(min(rest))} to {share(max(rest))}"]
        rows.append([one["title"], str(facts["robot_column_in_file"]), str(taken), *cells])
    return table(head, rows)


def seeds(found: Found) -> str:
    """Return how much the held-out score depends on the seed of the calibration."""
    many = [one for one in found.values() if len(one["seeds"]) > 1]
    head = ["recording", *(f"seed {seed}" for seed in sorted(many[0]["seeds"]))] if many else ["–"]
    rows = [[one["title"], *(score(S) for _, S in sorted(one["seeds"].items()))] for one in many]
    return table(head, rows)


def said(found: Found) -> str:
    """Return what was assumed or fitted."""
    return "\n".join(f"- **{one['title']}**: {' '.join(one['said'])}" for one in found.values())


def commands(found: Found) -> str:
    """Return the commands of the first trial with a robot, as an example."""
    shown = next((one for one in found.values() if one["positions"]["n_robots"]), None)
    lines = [] if shown is None else shown["commands"]
    return "\n".join(f"    {line}" for line in lines)


def pictures(found: Found) -> str:
    """Return one figure a recording."""
    return "\n\n".join(
        f"![{one['title']}: statistics of the second half and of the model of the first half]"
        f"(pictures/real-{name}.png)"
        for name, one in found.items()
    )


TABLES: dict[str, Callable[[Found], str]] = {
    "recordings": recordings,
    "said": said,
    "commands": commands,
    "scores": scores,
    "features": features,
    "statistics": statistics,
    "guesses": guesses,
    "control": control,
    "robots": robots,
    "columns": columns,
    "seeds": seeds,
    "pictures": pictures,
}


def fill(results: dict[str, Any], document: Path = DOCUMENT) -> Path:
    """Replace the tables in the document and return its path.

    Raises
    ------
    ValueError
        The document lacks the place of a table.
    """
    document.write_text(filled(document.read_text("utf-8"), results), encoding="utf-8")
    return document


def filled(text: str, results: dict[str, Any]) -> str:
    """Return a text with its tables replaced."""
    return replaced(text, {name: make(results["recordings"]) for name, make in TABLES.items()})


def replaced(text: str, tables: Mapping[str, str]) -> str:
    """Return a text with what stands between the comments of each name replaced.

    Raises
    ------
    ValueError
        The text lacks the place of one.
    """
    for name, made in tables.items():
        place = re.compile(rf"(<!-- {name} -->\n).*?(\n<!-- /{name} -->)", re.DOTALL)
        if len(place.findall(text)) != 1:
            raise ValueError(f"The text needs <!-- {name} --> and <!-- /{name} --> once.")
        body = made.replace("\\", r"\\")
        text = place.sub(rf"\g<1>\n{body}\n\g<2>", text)
    return text


def as_json(results: dict[str, Any]) -> str:
    """Return the results as JSON that is good to read: a list of numbers on one line."""
    text = json.dumps(_rounded(results), indent=1)
    inner = re.compile(r"\[\s+([-0-9.e+,\snul]*?)\s+\]")
    return (
        inner.sub(lambda m: f"[{', '.join(part.strip() for part in m[1].split(','))}]", text) + "\n"
    )


def _rounded(value: Any) -> Any:
    """Return nested values with all numbers to four decimals."""
    if isinstance(value, dict):
        return {key: _rounded(part) for key, part in value.items()}
    if isinstance(value, list):
        return [_rounded(part) for part in value]
    return round(value, DIGITS) if isinstance(value, float) else value


def _of_zone(half: dict[str, Any], z: int) -> tuple[str, ...]:
    """Return time, pair distance, wall distance, speed and stays of a zone as text."""
    return (
        share(half["O"]["frequency"][z]),
        _mm(half["D"]["mean"][z]),
        _mm(half["W"]["mean"][z]),
        f"{score(half['V']['mean'][z])} m/s",
        share(half["T"]["frequency"][z][z]),
    )


def _both(first: str, second: str) -> str:
    return "–" if "–" in first and "–" in second else f"{first} → {second}"


def _mm(length_m: float | None) -> str:
    return "–" if length_m is None else f"{1000 * length_m:.0f} mm"


def main() -> int:
    """Fill the document from the numbers that are there."""
    print(fill(json.loads(RESULTS.read_text("utf-8"))))
    return 0


if __name__ == "__main__":
    sys.exit(main())
