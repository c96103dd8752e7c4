"""The table ``[result]`` of a calibrated model: what a round found, and what that is worth."""

from __future__ import annotations

import math
from dataclasses import fields
from typing import Any

from zfcal.artifacts.lineage import JSON
from zfcal.behaviour.ceilings import Ceiling
from zfcal.behaviour.scores import NamedScore, Scores
from zfcal.calibrate.rounds import RoundResult
from zfcal.calibrate.rules import LIKELIHOOD, SAYS


def result_table(
    result: RoundResult,
    baselines: dict[str, JSON],
    likelihood: dict[str, JSON] | None = None,
) -> dict[str, JSON]:
    """Return the table ``[result]`` of a calibrated model.

    Parameters
    ----------
    result
        Of the round.
    baselines
        S of each baseline.
    likelihood
        The window's maximum-likelihood estimate; None without one.

    Returns
    -------
    dict
        S stands with its ceiling; a value that is NaN is None. Where other features are named,
        their score stands under ``score``, and what decided by it is called so.
    """
    last = result.history[-1]
    score = "S" if result.scores.named is None else "score"
    return {
        "generations": result.generations,
        "evaluations": result.evaluations,
        **score_table(result.scores, result.ceiling),
        "champion": "likely" if result.rule == LIKELIHOOD else result.rule,
        **published_table(result),
        f"optimiser_{score}": or_none(result.optimiser_score),
        "hypervolume": [or_none(line.hypervolume) for line in result.history],
        f"best_{score}_in_population": or_none(last.best_score),
        "world_changed": result.world_changed,
        "n_renewed": result.n_renewed,
        "baselines": baselines or None,
        "likelihood": likelihood,
        "intervals": _intervals_table(result, likelihood),
    }


def published_table(result: RoundResult) -> dict[str, JSON]:
    """Return why a model was published, where rules are judged."""
    if result.handed is None:
        return {}
    choice, record = result.handed.choice, result.handed.record
    lead = choice.lead
    return {
        "published": {
            "rule": choice.rule,
            "says": SAYS[choice.rule],
            "because": choice.because,
            "in_charge": choice.in_charge,
            "of_window_end_s": record.in_use.of_s if record.in_use else None,
            "lead": None if lead is None else or_none(lead.mean),
            "lead_error": None if lead is None else or_none(lead.error),
            "lead_windows": None if lead is None else lead.n,
            "forward": dict[str, JSON](record.means()) or None,
        }
    }


def _intervals_table(result: RoundResult, likelihood: dict[str, JSON] | None) -> dict[str, JSON]:
    """Return which values of each parameter the window allows, and what was published.

    By the window's likelihood where it has an estimate, whichever model was published; by the
    genomes that score as well where it has none.
    """
    found: Any = {} if likelihood is None else likelihood["parameters"]
    values = {part.name: part.value for part in result.intervals.parameters}
    rows: dict[str, JSON] = {}
    for part in result.intervals.parameters:
        own = found.get(part.name)
        scale = _row_scale(part.name, values, found)
        rows[part.name] = {
            "value": part.value,
            "low": part.low if own is None else own["low"] * scale,
            "high": part.high if own is None else own["high"] * scale,
            "identified": part.identified if own is None else own["identified"],
        }
    return {
        "by": "likelihood" if found else "score",
        "threshold": or_none(result.intervals.threshold),
        "n_compatible": result.intervals.n_compatible,
        "within_ceiling": result.intervals.within_ceiling,
        "parameters": rows,
    }


def _row_scale(name: str, values: dict[str, float], found: Any) -> float:
    """Return by what an estimate's gammas are to be multiplied to stand beside published ones.

    The largest gamma of a published row is 1, and may be that of a zone out of reach. The
    estimate's is 1 among those that the window tells of.
    """
    row, is_gamma, _ = name.partition(".gamma.")
    if not is_gamma or name not in found or _says_nothing(found[name]):
        return 1.0
    told = [
        value
        for other, value in values.items()
        if other.startswith(f"{row}.gamma.") and not _says_nothing(found[other])
    ]
    return max(told) or 1.0


def _says_nothing(entry: Any) -> bool:
    return (entry["low"], entry["high"]) == (0.0, 1.0)


def score_table(scores: Scores, ceiling: Ceiling) -> dict[str, JSON]:
    """Return S, its features and its ceiling as the entries of a table."""
    mean, low, high = ceiling.of("S")
    return {
        "S": or_none(scores.S),
        "ceiling": or_none(mean),
        "ceiling_low": or_none(low),
        "ceiling_high": or_none(high),
        "n_windows": ceiling.n_windows,
        "against_ceiling": _share(scores.S, mean),
        "features": {
            field.name: or_none(getattr(scores, field.name))
            for field in fields(scores)
            if field.name.startswith("I_")
        },
        "n_features": scores.n_features,
        **_named_table(scores.named, ceiling),
    }


def _named_table(named: NamedScore | None, ceiling: Ceiling) -> dict[str, JSON]:
    """Return the score of the features that were named, which is not S, and its ceiling."""
    if named is None:
        return {}
    mean, low, high = ceiling.overall
    return {
        "score": {
            "of": list(named.features),
            "value": or_none(named.value),
            "ceiling": or_none(mean),
            "ceiling_low": or_none(low),
            "ceiling_high": or_none(high),
            "against_ceiling": _share(named.value, mean),
            "similarities": {
                name: or_none(value)
                for name, value in zip(named.features, named.similarities, strict=True)
            },
            "n_features": named.n_features,
        }
    }


def _share(value: float, mean: float) -> float | None:
    """Return a score over its ceiling; None without a ceiling."""
    return or_none(value / mean if mean > 0 else math.nan)


def or_none(value: float) -> float | None:
    """Return a number as a file states it: None for NaN."""
    return None if math.isnan(value) else float(value)
