"""Whether fish follow the robot, in plain words."""

from __future__ import annotations

import math

from zfcal.report.contents import Gap, Statement
from zfcal.report.followed import DELAY, FOLLOWED, FOLLOWING, LEAD, LED, Followed, Level
from zfcal.report.views import TrialView

_QUESTION = "Do the fish follow the robot?"


def followed_statement(view: TrialView) -> Statement | None:
    """Return what there is to say; None where it was not measured."""
    found = view.following
    if found is None:
        return None
    following = found.measures[FOLLOWING]
    if math.isnan(following.value):
        return Statement(question=_QUESTION, answer="The robot was never seen near a fish.")
    answer = " ".join([_follow(found, following), _lead(found), _departures(found)])
    lead = found.measures[LEAD].value
    return Statement(
        question=_QUESTION,
        answer=answer,
        figure=(f"{lead:+.2f}", "lead over the fish: below 0 the robot follows"),
    )


def followed_gap(view: TrialView) -> Gap | None:
    """Return what is missing; None where it was measured, or there is nothing to measure yet."""
    if not (view.trial.n_robots and view.statistics) or view.following is not None:
        return None
    what = "Whether fish follow the robot has not been measured yet."
    return Gap(what=what, command=f"zfcal analyse {view.name}")


def _follow(found: Followed, level: Level) -> str:
    chance = ""
    if not math.isnan(level.floor):
        chance = (
            f" Its track at other times of the fish gives up to {level.floor:.2f} by chance; "
            f"above that it is in {level.n_above} of {_windows(level.n_windows)}, where chance "
            "alone is in one of 20."
        )
    return (
        f"From {found.start_s / 60:g} to {found.end_s / 60:g} min fish near the robot swim where "
        f"it swam up to 2 s before with a mean cosine of {level.value:.2f}{_interval(level)}"
        f"{_in_place(level)}.{chance}"
    )


def _lead(found: Followed) -> str:
    lead, delay = found.measures[LEAD], found.measures[DELAY]
    number = f"{lead.value:+.2f}{_interval(lead)}"
    if math.isnan(lead.low):
        return f"Its lead is {number}: there are too few windows to say who turns first."
    if lead.low <= 0 <= lead.high:
        return f"Its lead is {number}: neither it nor the fish turn first."
    who = "it is the first" if lead.value > 0 else "the fish are the first"
    when = (
        ""
        if math.isnan(delay.value)
        else f" The delay is {delay.value:+.1f} s, in {_windows(delay.n_windows)} with one."
    )
    between = ""
    if not math.isnan(lead.ceiling_low):
        between = f"{lead.ceiling_low:+.2f} and {lead.ceiling_high:+.2f}"
        between = f"; of single fish it lies between {between}"
    return f"Its lead is {number}: where both turn alike {who}{between}.{when}"


def _departures(found: Followed) -> str:
    led, own = found.measures[LED], found.measures[FOLLOWED]
    if not found.has_rooms:
        return "This tank has not two rooms: departures from a room are not defined."
    if not led.n:
        return "The group did not leave a room together."
    text = f"Of the group's departures from a room it led {_share(led)}{_in_place(led)}"
    if not math.isnan(led.floor):
        text += f"; at other times of the fish it would lead up to {led.floor:.2f} by chance"
    if own.n:
        text += f"; {_share(own)} of its own were followed{_in_place(own)}"
    return text + "."


def _interval(level: Level) -> str:
    return "" if math.isnan(level.low) else f" (95 % {level.low:.2f} to {level.high:.2f})"


def _in_place(level: Level) -> str:
    if math.isnan(level.ceiling):
        return ""
    return (
        f", a fish in its place {level.ceiling:.2f} ({level.ceiling_low:.2f} to "
        f"{level.ceiling_high:.2f})"
    )


def _share(level: Level) -> str:
    return f"{level.value:.2f}"


def _windows(n: int) -> str:
    return f"{n} window{'' if n == 1 else 's'}"
