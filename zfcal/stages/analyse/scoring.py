"""What is counted in a window, and what is compared with what."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from zfcal.behaviour.ceilings import Ceiling, summarise
from zfcal.behaviour.legacy import compare_legacy, extent_of, measure_legacy
from zfcal.behaviour.located import Located
from zfcal.behaviour.pooling import Pool
from zfcal.behaviour.rows import SCORES_COLUMNS, Table, join_tables, scores_to_rows
from zfcal.behaviour.scores import Scores, compare
from zfcal.behaviour.statistics import Statistics, measure, measure_robot
from zfcal.stages.analyse.control import ControlGroup
from zfcal.tracks import FISH

SCORINGS = ("paper", "legacy")


@dataclass(frozen=True, kw_only=True)
class Window:
    """What a window's scores are made of.

    Parameters
    ----------
    end_s
        Where it ends, in seconds since trial start.
    points
        All agents of the window.
    pool
        What all agents did over the longer stretch on which the robot is judged;
        None where it is not judged.
    has_robot
        Whether a robot is in the tank.
    control
        The control group; None for the fish of the window itself.
    further
        Statistics to count beside D, W, O, T and V.
    """

    end_s: int
    points: Located
    pool: Pool | None
    has_robot: bool
    control: ControlGroup | None = None
    further: tuple[str, ...] = ()

    @property
    def is_social(self) -> bool:
        """Whether there is something to hold against the control."""
        return self.has_robot or self.control is not None

    @cached_property
    def cases(self) -> dict[str, Statistics]:
        """The statistics by case: control, and social and robot as there are."""
        arena, further = self.points.arena, self.further
        if self.control is None:
            fish = self.points.of_kind(FISH)
            cases = {"control": measure(fish, arena, further=further)}
        else:
            cases = {"control": self.control.with_further(further)}
        if self.is_social:
            cases["social"] = measure(self.points, arena, further=further)
        if self.has_robot:
            cases["robot"] = measure_robot(self.points, arena, further=further)
        return cases


def scores_of(window: Window, scoring: str) -> Table:
    """Return the rows of a window's scores, none where nothing can be compared.

    Parameters
    ----------
    window
        What to score.
    scoring
        One of `SCORINGS`. The authors' scripts know no robot-vs-fish.
    """
    made: list[tuple[str, Scores, Ceiling | None]] = []
    if window.is_social:
        cases = window.cases
        paper = scoring == "paper"
        social = compare(cases["social"], cases["control"]) if paper else _legacy(window)
        made.append(("social-vs-control", social, None))
    if window.pool is not None and scoring == "paper":
        made.append(("robot-vs-fish", *_robot(window.pool)))
    tables = [
        scores_to_rows(scores, window_end_s=window.end_s, compared=compared, ceiling=ceiling)
        for compared, scores, ceiling in made
    ]
    return join_tables([{name: [] for name in SCORES_COLUMNS}, *tables])


def _robot(pool: Pool) -> tuple[Scores, Ceiling | None]:
    in_its_place = pool.robot_ceiling()
    ceiling = summarise(in_its_place) if in_its_place else None
    return compare(pool.robot(), pool.fish()), ceiling


def _legacy(window: Window) -> Scores:
    arena = window.points.arena
    extent_m = extent_of(arena)
    social = measure_legacy(window.points, arena, extent_m=extent_m)
    if window.control is not None:
        return compare_legacy(social, window.control.legacy(extent_m))
    fish = measure_legacy(window.points.of_kind(FISH), arena, extent_m=extent_m)
    return compare_legacy(social, fish)
