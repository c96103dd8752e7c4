"""Which pictures a report has, in the order in which they are told."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from zfcal.report.figures.arena import arena_picture
from zfcal.report.figures.followed import followed_picture
from zfcal.report.figures.panels import Picture
from zfcal.report.figures.parameters import parameters_picture
from zfcal.report.figures.presence import presence_picture
from zfcal.report.figures.rules import rules_picture
from zfcal.report.figures.scores import scores_picture
from zfcal.report.figures.search import search_picture
from zfcal.report.figures.statistics import statistics_picture
from zfcal.report.figures.tracks import tracks_picture
from zfcal.report.views import MODEL, ROBOT, SOCIAL, TrialView
from zfcal.tracks import FISH
from zfcal.units import WINDOW_S

_ARENA_IN = 4.2


def pictures_of_trial(view: TrialView) -> list[Picture]:
    """Return the pictures that a trial has the artifacts for; the arena always."""
    made = (
        *_scores([view]),
        followed_picture(view.following),
        rules_picture(view.rule_scores),
        _statistics(view),
        _presence(view),
        parameters_picture(view.rounds),
        search_picture(view.rounds),
        None if view.seen is None else tracks_picture(view.seen),
        arena_picture(view.arena, width_in=_ARENA_IN),
    )
    return [picture for picture in made if picture is not None]


def pictures_of_trials(views: Sequence[TrialView]) -> list[Picture]:
    """Return the pictures over several trials in one arena."""
    made = (*_scores(views), arena_picture(views[0].arena, width_in=_ARENA_IN))
    return [picture for picture in made if picture is not None]


def _scores(views: Sequence[TrialView]) -> Iterator[Picture | None]:
    for compared, name, title, short in (
        (MODEL, "scores", "Model against fish", "Model"),
        (ROBOT, "integration", "Robot against fish", "Robot"),
        (SOCIAL, "social", "Fish with robot against fish alone", "Fish with robot"),
    ):
        yield scores_picture(views, compared, name=name, title=title, short=short)


def _presence(view: TrialView) -> Picture | None:
    if view.seen is None:
        return None
    fish = view.seen.visits.get(FISH)
    return presence_picture(fish, view.model_visits, view.arena, end_s=view.seen.end_s)


def _statistics(view: TrialView) -> Picture | None:
    """Return fish, model and robot of the last calibrated window, or of the last one."""
    if not view.statistics:
        return None
    end_s = max(end for end, _ in view.statistics)
    fish = view.statistics.get((end_s, "control"))
    if fish is None:
        return None
    cases = {"fish": fish}
    last = view.calibrated
    if view.model_statistics is not None and last is not None and last.second == end_s:
        cases["model"] = view.model_statistics
    robot = view.statistics.get((end_s, "robot"))
    if robot is not None:
        cases["robot"] = robot
    who = "Fish of the control trials" if view.has_control_trials else "Fish"
    title = " and ".join([who, *(case for case in cases if case != "fish")])
    window = f"{max(end_s - int(WINDOW_S), 0)} to {end_s} s"
    return statistics_picture(cases, view.arena, title=f"{title}, {window}")
