"""How rounds are done: what the options of a calibration come to, and of a watch."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from zfcal.api.values import existing, flag, names, one_of, seconds, seed, taken, whole
from zfcal.behaviour.features.registry import SCORED, further
from zfcal.calibrate.task import Settings
from zfcal.errors import OptionError
from zfcal.stages.calibrate.searching import AS_PUBLISHED, CalibrateOptions

CHAMPIONS: dict[str, Any] = {
    "forward": "forward",
    "score": "score",
    "likelihood": "likely",
    "likely": "likely",
}
"""What `zfcal.calibrate.task.Settings` calls each way to publish."""

_FORMS = {
    "generations": whole(0),
    "budget": seconds,
    "optimiser": one_of("zfcal", "deap"),
    "model": existing,
    "publish": one_of("forward", "score", "likelihood"),
    "confirm": whole(0),
    "diversity": one_of("merged", "population"),
    "seed": seed,
    "workers": whole(1),
    "seed_likelihood": flag,
    "renewal": flag,
}
_NEEDED = {
    "population": whole(4),
    "runs": whole(1),
    "steps": whole(1),
    "sampler": one_of("exact", "grid"),
    "as_published": flag,
    "baselines": flag,
    "features": names,
}


def round_options(options: Mapping[str, Any]) -> CalibrateOptions:
    """Return how to calibrate, as the options of a command say.

    Parameters
    ----------
    options
        By the names of the arguments of `zfcal.calibrate`; ``champion`` is the older name of
        ``publish``. None where nothing is said.

    Raises
    ------
    OptionError
        One has another form, two contradict each other, or one could not take effect.
    """
    asked = _as_published(taken(options, _FORMS, needed=_NEEDED))
    _check_together(asked)
    publish, window = published_by(asked), asked.get("window")
    settings = Settings(
        population=asked["population"],
        generations=asked["generations"],
        runs=asked["runs"],
        steps=asked["steps"],
        optimiser=asked["optimiser"],
        champion=CHAMPIONS[publish or "score"],
        features=asked.get("features", SCORED),
        n_confirmed=asked["confirm"],
        diversity=asked["diversity"],
        renews=asked["renewal"],
        sampler=asked["sampler"],
    )
    if asked.get("cluster") is not None and further(settings.features):
        raise OptionError("--cluster counts D, W, O, T and V: no other --features.")
    return CalibrateOptions(
        settings=settings,
        budget_s=asked["budget"],
        seed=asked["seed"],
        n_workers=asked["workers"],
        baselines=asked["baselines"],
        seed_likelihood=asked["seed_likelihood"],
        model=asked["model"],
        keeps_way=publish is None and window is None,
    )


def published_by(options: Mapping[str, Any]) -> str | None:
    """Return who hands models on, by the option's name or its older one; None where unsaid."""
    champion = options.get("champion")
    if options["publish"] and champion:
        raise OptionError("--publish and --champion say the same: give one.")
    found: str | None = options["publish"] or champion
    return found


def _as_published(options: Mapping[str, Any]) -> dict[str, Any]:
    """Return the options with what nobody gave: what is usual, or what the paper did.

    The paper's way itself stands in `zfcal.stages.calibrate.searching`.
    """
    is_published = bool(options.get("as_published"))
    if is_published and options.get("champion") is not None:
        raise OptionError("--as-published publishes by score: say otherwise by --publish.")
    way = AS_PUBLISHED if is_published else CalibrateOptions()
    unsaid = {
        "optimiser": way.settings.optimiser,
        "seed_likelihood": way.seed_likelihood,
        "publish": way.settings.champion if is_published else None,
        "confirm": way.settings.n_confirmed,
        "diversity": way.settings.diversity,
        "renewal": way.settings.renews,
    }
    return {**options, **{name: v for name, v in unsaid.items() if options[name] is None}}


def _check_together(options: Mapping[str, Any]) -> None:
    if options["generations"] is not None and options["budget"] is not None:
        raise OptionError("A round ends after --generations or with its --budget: give one.")
    publish, window = published_by(options), options.get("window")
    if publish in {"likely", "likelihood"} and not options["seed_likelihood"]:
        raise OptionError("--publish likelihood is the estimate, which --no-seed-likelihood omits.")
    if publish == "forward" and window is not None:
        raise OptionError("--publish forward judges round after round: --window has one.")
    if window is None:
        for name, option in (("held_out", "--held-out"), ("out", "-o")):
            if options.get(name) is not None:
                raise OptionError(f"{option} belongs to --window, which is not given.")
    elif options.get("out") is None:
        raise OptionError("--window needs -o FILE: its model belongs to no round of the trial.")
    if options.get("cluster") is not None and options["workers"] is not None:
        raise OptionError("--workers are threads of this machine: with --cluster it has none.")
