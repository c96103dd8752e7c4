"""The tables of `bench_diagnosis.py`, and its JSON."""

from __future__ import annotations

import json
import textwrap
from collections.abc import Mapping, Sequence
from typing import Any

from benchmarks.diagnosis.answers import DESCRIBES, FATES, NAMELESS, NOTHING
from benchmarks.diagnosis.plan import FURTHER_NOISE_MM, SECTIONS, VIDEO
from benchmarks.shared.measuring import table

MODES = {"full": "39 replicates", "quick": "`--quick`"}
"""Modes of the diagnosis, and what people call them."""

_DASH = "–"
_SAYS = {
    "listed": "one listed effect, 30 min, clear",
    "further": "a further form of a listed effect, 30 min, faint and clear",
    "strengths": "faint and strong",
    "lengths": "2 and 10 min, clear",
    "without-robot": "30 min, clear, no robot",
    "nulls": "nothing hidden: nulls and decoys",
    "pairs": "two effects at once",
    "outside": "effects outside the list",
    "extend": "`zfcal extend`, 30 generations",
    "video": "rendered to video and tracked",
    "time": "timed alone, two threads",
}


def as_json(found: Mapping[str, Any]) -> str:
    """Return the numbers as JSON, the trials with a line each."""
    text = json.dumps({**found, "trials": "@"}, indent=1)
    lines = ",\n".join("  " + json.dumps(trial) for trial in found["trials"])
    return text.replace('"trials": "@"', f'"trials": [\n{lines}\n ]') + "\n"


def share(rate: Mapping[str, Any]) -> str:
    """Return a rate with n and interval, such as ``95 % (19/20, 76 to 99)``."""
    if not rate["n"]:
        return f"{_DASH} (0)"
    percent, low, high = (f"{100 * rate[key]:.0f}" for key in ("share", "low", "high"))
    return f"{percent} % ({rate['hits']}/{rate['n']}, {low} to {high})"


def markdown(found: Mapping[str, Any]) -> str:
    """Return the document: what was run, what was aimed at, and what came out."""
    parts = [*_head(found), *_targets(found)]
    for mode, told in _modes(found):
        sections = {
            "One effect at a time": _effects(told),
            "Further forms": _further(told),
            "Hidden and said": _confusion(mode, told),
            "Power": _power(mode, told),
            "Nothing hidden": _nulls(told),
            "Two effects at once": _pairs(told),
            "Effects outside the list": _outside(told),
        }
        for title, blocks in sections.items():
            parts += [f"## {title}: {MODES[mode]}\n", *blocks] if blocks else []
    return "\n".join([*parts, *_gap(found), *_through_video(found), *_time(found)])


def _modes(found: Mapping[str, Any]) -> list[tuple[str, Mapping[str, Any]]]:
    return [(mode, found["modes"][mode]) for mode in MODES if mode in found["modes"]]


def _prose(text: str) -> str:
    made = textwrap.fill(
        " ".join(text.split()), 120, break_long_words=False, break_on_hyphens=False
    )
    return made + "\n"


def _head(found: Mapping[str, Any]) -> list[str]:
    modes = dict(_modes(found))
    rows: list[list[object]] = []
    for section in SECTIONS:
        done = [str(modes[mode]["n"].get(section, 0)) if mode in modes else "0" for mode in MODES]
        # Numbers of an earlier plan have no row for what came later.
        if section in found["planned"]:
            rows.append([section, _SAYS[section], found["planned"][section], *done])
    return [
        "# Does the diagnosis find what was hidden?\n",
        _prose(
            f"""Made by `make bench-diagnosis`; numbers and every trial in
            `benchmarks/results/diagnosis.json`. A second simulator under `tests/hidden`, which
            shares no code with zfcal and whose effects have other forms, hides effects in trials;
            each is written as CSV at 15 Hz, imported and diagnosed as the commands do it, with the
            position noise estimated from the tracks, not given. Strength is in oracle nats: the
            sum over steps of log f_true minus log f_base, the base law at its own maximum
            likelihood. Seeds are {_seeds(found)}. Intervals are Wilson's, 95 %. Code
            {_codes(found)}. Machine: {found["machine"]}, shared with other work."""
        ),
        _completeness(found),
        table(("section", "trials", "planned", *MODES.values()), rows),
    ]


def _seeds(found: Mapping[str, Any]) -> str:
    """Return the least and the greatest seed of the trials that are told."""
    return " to ".join(map(str, found.get("seeds") or ["none yet"]))


def _codes(found: Mapping[str, Any]) -> str:
    """Return the fingerprints of the code that each mode's trials were made by."""
    of_mode = {
        mode: f"diagnosis {code['diagnosis']}, extension {code['extension']}"
        for mode, code in found["code"].items()
        if mode in found["modes"]
    }
    if len(set(of_mode.values())) == 1:
        return next(iter(of_mode.values()))
    return "; ".join(f"with {MODES[mode]}: {said}" for mode, said in of_mode.items())


def _completeness(found: Mapping[str, Any]) -> str:
    """Say whether all that was planned was done in one of the modes."""
    planned = found["planned"]
    full = dict(_modes(found)).get("full", {"n": {}})
    short = [section for section, n in planned.items() if full["n"].get(section, 0) < n]
    if not short:
        return "A complete run with 39 replicates.\n"
    of_mode = [
        f"{sum(told['n'].get(section, 0) for section in planned)} with {MODES[mode]}"
        for mode, told in _modes(found)
    ]
    done = " and ".join(of_mode) or "none"
    quick = dict(_modes(found)).get("quick", {"n": {}})
    whole = all(quick["n"].get(section, 0) >= n for section, n in planned.items())
    if whole:
        return _prose(
            f"""**Complete with `--quick`**, {sum(planned.values())} trials. With 39 replicates,
            which take six times as long, {sum(full["n"].values())} of them were run."""
        )
    return _prose(
        f"""**A partial run.** Of {sum(planned.values())} planned trials {done} were run; the
        others, however few these are, do not count below, and the intervals say how little
        some of the numbers mean. Trials come in an order in which any first part is balanced."""
    )


def _targets(found: Mapping[str, Any]) -> list[str]:
    modes = _modes(found)
    rows: list[list[object]] = []
    for number in range(len(modes[0][1]["targets"]) if modes else 0):
        each = [told["targets"][number] for _, told in modes]
        rows.append([each[0]["what"], each[0]["target"] or _DASH, *(share(rate) for rate in each)])
    return [
        "## What was aimed at\n",
        _prose(
            """Shares in per cent (hits/n, interval). Named rightly: the first effect is the hidden
            one and tied with no other. A wrong name anywhere: any effect, the second or third as
            well, that is not hidden and not tied, generic ones included. By nats: 30 min, four
            fish and a robot, all strengths. Failed trials count in every n."""
        ),
        table(("", "target", *(MODES[mode] for mode, _ in modes)), rows),
    ]


def _effects(told: Mapping[str, Any]) -> list[str]:
    rows = [
        [name, _number(each["median_nats"]), *(share(each[k]) for k in ("right", "tie", "wrong"))]
        for name, each in told["effects"].items()
    ]
    head = ("hidden", "oracle nats (median)", "named rightly", "tie with it", "a wrong name")
    about = "30 minutes, four fish and a robot, clear strength.\n"
    return [about, table(head, rows)] if rows else []


def _further(told: Mapping[str, Any]) -> list[str]:
    rows = [
        [
            each["effect"],
            each["form"] or "all",
            each["strength"],
            _number(each["median_nats"]),
            *(share(each[fate]) for fate in FATES),
        ]
        for each in told.get("further", ())
    ]
    about = _prose(
        f"""Each listed effect in forms that others might have written, with constants of the
        seed's own; 30 minutes, four fish and a robot, in a third of the trials
        {FURTHER_NOISE_MM:g} mm of noise. A tie holds a name that fits. Silence is a verdict that
        claims nothing; all else that is said counts as wrong, that something is unexplained as
        well."""
    )
    head = (
        "hidden", "form", "strength", "oracle nats (median)", "named rightly", "tie with it",
        "silent", "wrong",
    )  # fmt: skip
    return [about, table(head, rows)] if rows else []


def _confusion(mode: str, told: Mapping[str, Any]) -> list[str]:
    if not told["confusion"]:
        return []
    rows = [
        [true, sum(answers.values()), _named(true, answers), _counted(answers, but=true)]
        for true, answers in told["confusion"].items()
    ]
    turned = [
        [answer, _of_what(answer, each), _counted(each["hidden"], but=answer)]
        for answer, each in told["inversion"].items()
    ]
    return [
        f"![What was said by what was hidden](pictures/diagnosis-confusion-{mode}.png)\n",
        "All lengths and strengths, and nulls, for which silence is right.\n",
        table(("hidden", "trials", "so named", "said instead"), rows),
        _prose(
            """The other way round: of what was said, how often it was so. This depends on the
            mixture of trials, which hides each effect equally often."""
        ),
        table(("said", "was hidden", "hidden instead"), turned),
    ]


def _named(true: str, answers: Mapping[str, int]) -> object:
    return _DASH if true == NOTHING else answers.get(true, 0)


def _of_what(answer: str, each: Mapping[str, Any]) -> str:
    """Return how often a name was right; a verdict that names nothing has no such share."""
    return _DASH if answer in NAMELESS else share(each["rate"])


def _counted(counts: Mapping[str, int], *, but: str) -> str:
    some = sorted((-n, name) for name, n in counts.items() if name != but)
    return ", ".join(f"{name} {-n}" for n, name in some) or _DASH


def _number(value: float | None) -> str:
    return _DASH if value is None else f"{value:.0f}"


def _power(mode: str, told: Mapping[str, Any]) -> list[str]:
    rows = [
        [
            "all" if each["minutes"] is None else f"{each['minutes']:g}",
            _bin(each["nats"]),
            *(share(each[key]) for key in ("right", "tie", "wrong")),
        ]
        for each in told["power"]
        if each["right"]["n"]
    ]
    head = ("minutes", "oracle nats", "named rightly", "tie with it", "a wrong name")
    picture = f"![Power by nats and by minutes](pictures/diagnosis-power-{mode}.png)\n"
    return [picture, table(head, rows)] if rows else []


def _bin(edges: Sequence[float | None]) -> str:
    low, high = edges
    return f"{low:g} and more" if high is None else f"{low:g} to {high:g}"


def _nulls(told: Mapping[str, Any]) -> list[str]:
    kinds = [[kind, share(each)] for kind, each in told["nulls"].items()]
    noise = [
        [f"{each['noise_mm']:g}", _estimated(each["estimated_mm"]), share(each["alarm"])]
        for each in told["noise"]
    ]
    head = ("noise added (mm)", "estimated (mm, median)", "says anything at all")
    return [table(("decoy", head[-1]), kinds), table(head, noise)] if kinds else []


def _estimated(value: float | None) -> str:
    return _DASH if value is None else f"{value:.2f}"


def _pairs(told: Mapping[str, Any]) -> list[str]:
    rows = [[kind, share(each)] for kind, each in told["pairs"].items()]
    return [table(("pair", "both named"), rows)] if rows else []


def _outside(told: Mapping[str, Any]) -> list[str]:
    rows = [
        [true, ", ".join(DESCRIBES.get(true, ())) or _DASH, _counted(answers, but="")]
        for true, answers in told["outside"].items()
    ]
    head = ("hidden", "listed names that describe it in part", "said first")
    return [table(head, rows)] if rows else []


def _gap(found: Mapping[str, Any]) -> list[str]:
    made = ["## Extended\n"]
    rows = [
        [MODES[mode], measure, *(_quartiles(each[key]) for key in ("closed", "placebo"))]
        for mode, told in _modes(found)
        for measure, each in told["gap"].items()
    ]
    if rows:
        made.append(table(("findings by", "measure", "share closed", "placebo"), rows))
        made.append("Medians and quartiles; targets: 80 % closed, the placebo at most 5 %.\n")
    else:
        made.append("Not run: no trial was extended yet.\n")
    return made


def _through_video(found: Mapping[str, Any]) -> list[str]:
    rows = [
        [
            trial["kind"],
            _DASH if trial["nats"] is None else f"{trial['nats']:.0f}",
            ", ".join(trial["effects"]) or trial["answer"],
        ]
        for trial in found["trials"]
        if trial["section"] == VIDEO and trial["error"] is None
    ]
    if rows:
        told = table(("hidden", "oracle nats", "said"), rows)
    else:
        told = "Not run: no trial was rendered yet.\n"
    return ["## Through video\n", told]


def _quartiles(found: Mapping[str, Any]) -> str:
    if not found["n"]:
        return f"{_DASH} (0)"
    low, middle, high = (f"{100 * found[key]:.0f}" for key in ("low", "median", "high"))
    return f"{middle} % (n {found['n']}, {low} to {high})"


def _time(found: Mapping[str, Any]) -> list[str]:
    rows: list[list[object]] = []
    for mode, told in _modes(found):
        for key, name in (("cpu_s", "processor"), ("wall_s", "wall clock")):
            each = told["time"][key]
            if each["n"]:
                spread = f"{each['low']:.1f} to {each['high']:.1f}"
                rows.append([MODES[mode], name, each["n"], f"{each['median']:.1f}", spread])
        rows += [
            [
                MODES[mode], f"alone, {each['workers']} threads, hiding {each['kind']}", 1,
                f"{each['wall_s']:.1f}",
                f"processor {each['cpu_s']:.1f}; whole command {each['command_s']:.1f}",
            ]
            for each in told["time"]["alone"]
        ]  # fmt: skip
    return [
        "## Time\n",
        _prose(
            """Of `zfcal diagnose` on 30 minutes, without making the trial; medians and quartiles
            in seconds, one thread each while others were at work. Targets, on two cores: 60 s with
            39 replicates, 10 s with `--quick`. The whole command starts Python and draws the
            page as well."""
        ),
        table(("mode", "clock", "n", "median (s)", "quartiles (s)"), rows),
    ]
