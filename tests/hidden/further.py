"""Further forms of the listed effects, as others who study fish might write them.

A diagnosis that knows one form of each effect is flattered by trials that hide that form.
Here each listed effect has one or two more, by another mechanism or dependence; constants
such as a reach or a lag are drawn by the seed. Lengths are metres, times seconds.

Strengths are calibrated as those of `hidden.effects`, on half hours of four fish and a
robot, the base refitted, each law with its best lapse, and lower: a median of 20 to 50 nats is
faint, 50 to 150 clear, more is strong. One to three strengths of a form were measured, the others
follow from these by a power law; `hidden.strengths` prints what each is worth. Bouts (freezing)
scatter by the number that happen; an oracle counts them as known, which takes some nats off. A
component of the mixture changes few steps, each by much.
"""

from __future__ import annotations

import numpy as np

from hidden import states
from hidden.effects import EFFECTS, HEADING, SPEED, Effect

K = states
LATE_IN_TRIAL = (480.0, 1320.0)


def _form(key, column, on, strengths, form, *, also=(), **constants):
    faint, clear, strong = strengths
    return key, Effect(
        column=column, on=on, faint=faint, clear=clear, strong=strong, form=form,
        name=key.split("/")[0], also=also,
        constants=tuple((what, *span) for what, span in constants.items()),
    )  # fmt: skip


FURTHER = dict([
    _form(
        "alignment/flow", K.FLOW, HEADING, (0.16, 0.26, 0.45),
        "headings weigh by exp(w cos) of the angle to the mean heading of the others within "
        "reach, w the larger the more they agree",
        reach_m=(0.08, 0.25),
    ),
    _form(
        "alignment/nearest", K.NEAREST_HEADING, HEADING, (0.15, 0.25, 0.42),
        "headings weigh by exp(w cos) of the angle to the heading of the nearest, w falling "
        "off with distance",
        fall_m=(0.06, 0.15),
    ),
    _form(
        "wall-persistence/recent-sense", K.RECENT_SENSE, HEADING, (0.18, 0.295, 0.5),
        "of the two senses along a wall that of the last 3 s is preferred, the latest most",
        fade_s=(0.5, 2.0),
    ),
    _form(
        "group-cohesion/centroid", K.CENTROID, HEADING, (0.014, 0.035, 0.075),
        "a component toward the centroid of all others, seen or not, growing with its distance",
        half_m=(0.1, 0.3),
        kappa=(2.0, 6.0),
    ),
    _form(
        "group-cohesion/regain", K.REGAIN, HEADING, (0.45, 0.66, 1.2),
        "a fish farther than R from all others leans toward the nearest, seen or not",
        beyond_m=(0.08, 0.2),
    ),
    _form(
        "interaction-range/decay", K.RANGE_DECAY, HEADING, (2.2, 4.2, 9.7),
        "a neighbour's weight falls off by exp(-g d), g per metre",
    ),
    _form(
        "rear-blind-zone/cardioid", K.REAR_CARDIOID, HEADING, (0.21, 0.35, 0.63),
        "a neighbour's weight falls off by the s-th power of (1 + cos) / 2 of its bearing",
    ),
    _form(
        "leader-following/one-leader", K.ONE_LEADER, HEADING, (0.4, 0.65, 1.2),
        "one fish, the same all the time, attracts the others 1 + w times more",
        who=(0.0, 1.0),
    ),
    _form(
        "reaction-delay/snapshot", K.SNAPSHOT, HEADING, (0.0051, 0.0115, 0.026),
        "a share of the attraction goes in the direction in which a neighbour was 0.4 to 1 s "
        "ago, from where the fish was then",
        lag_steps=(2.0, 6.0),
    ),
    _form(
        "collective-departure/quorum", K.QUORUM, HEADING, (0.18, 0.28, 0.65),
        "a component toward the door, by the share of the others that left in the last seconds",
        memory_s=(3.0, 8.0),
    ),
    _form(
        "place-preference/home", K.HOME, HEADING, (0.1, 0.17, 0.3),
        "in the room of a liked place headings weigh by exp(w cos) of the angle to it",
    ),
    _form(
        "directional-drift/bend", K.BEND, HEADING, (0.056, 0.092, 0.17),
        "the base heading bends to a direction of the compass by the sine of the angle; along "
        "a wall the sense nearer to it is preferred",
        also=("place-preference",),
    ),
    _form(
        "turning-bias/sides", K.SIDES, HEADING, (0.1, 0.155, 0.28),
        "headings weigh by 1 + b sin of the angle to the left of the present one",
    ),
    _form(
        "turning-memory/leaky", K.LEAKY_TURN, HEADING, (0.066, 0.11, 0.19),
        "the base heading is rotated by a share of the mean turn of the last seconds, the "
        "latest counting most",
        fade_s=(0.2, 0.8),
    ),
    _form(
        "turning-memory/alternation", K.ALTERNATION, HEADING, (0.1, 0.17, 0.31),
        "headings to the side of the last turn weigh less, those to the other side more",
    ),
    _form(
        "speed-matching/company", K.COMPANYS_PACE, SPEED, (0.05, 0.085, 0.13),
        "the speed is multiplied by a power of the mean pace of the others within reach",
        reach_m=(0.08, 0.25),
    ),
    _form(
        "speed-matching/nearest", K.NEARESTS_PACE, SPEED, (0.047, 0.076, 0.13),
        "the normal score of the speed is correlated with the last one of the nearest",
    ),
    _form(
        "crowding/nearest", K.NEAR_ANOTHER, SPEED, (0.095, 0.12, 0.2),
        "a fish slows down close to its nearest, by a share that falls off with distance",
        fall_m=(0.03, 0.10),
    ),
    _form(
        "crowding/jostle", K.JOSTLE, SPEED, (0.028, 0.062, 0.1),
        "with two or more others within reach a fish swims faster by a share",
        reach_m=(0.08, 0.15),
    ),
    _form(
        "burst-and-coast/glide", K.GLIDE, SPEED, (0.043, 0.08, 0.12),
        "a fast fish keeps a share of its last speed, a little slower, and draws the rest",
        above_m_s=(0.05, 0.09),
        kept=(0.7, 0.95),
    ),
    _form(
        "burst-and-coast/rhythm", K.RHYTHM, SPEED, (0.048, 0.076, 0.13),
        "the normal scores of speeds swing in about 0.8 s: a fast step makes that two later "
        "slow, and the next a little slower or faster",
        angle_rad=(1.05, 2.1),
    ),
    _form(
        "speed-turn-coupling/after-turn", K.AFTER_TURN, SPEED, (0.047, 0.07, 0.12),
        "after a wide turn the next step is slower by a share",
        wide_rad=(0.5, 1.2),
    ),
    _form(
        "freezing/shy", K.SHY_FREEZE, SPEED, (0.0006, 0.001, 0.0025),
        "at so many times a second the shyer half of the fish stop, for 1 to 4 s in the mean",
        mean_s=(1.0, 4.0),
    ),
    _form(
        "freezing/crawl", K.CRAWL, SPEED, (0.0014, 0.003, 0.007),
        "at so many times a second a fish all but stops: it crawls at less than 1.5 cm/s for "
        "a second or two",
        mean_s=(0.6, 2.0),
    ),
    _form(
        "fatigue/sudden", K.SUDDEN_FATIGUE, SPEED, (0.05, 0.07, 0.12),
        "from a moment in the trial on the speed is lower by a share",
        from_s=LATE_IN_TRIAL,
    ),
    _form(
        "fatigue/uneven", K.UNEVEN_FATIGUE, SPEED, (0.057, 0.083, 0.135),
        "the shyer half of the fish tire within minutes, to a speed lower by a share",
        fade_s=(240.0, 720.0),
    ),
    _form(
        "habituation/sudden", K.SUDDEN_HABITUATION, HEADING, (0.26, 0.43, 0.78),
        "from a moment in the trial on neighbours weigh less by a share",
        from_s=LATE_IN_TRIAL,
    ),
    _form(
        "boldness/centre", K.BOLD_CENTRE, HEADING, (0.38, 0.58, 0.97),
        "each fish's attraction to the centre zone is multiplied by exp(s z), z its own",
    ),
    _form(
        "robot-avoidance/flee", K.FLEE_ROBOT, HEADING, (0.02, 0.038, 0.085),
        "a component away from the robot within reach, seen or not, the more the nearer",
        reach_m=(0.08, 0.25),
        kappa=(2.0, 6.0),
    ),
])  # fmt: skip

FORMS = {**EFFECTS, **FURTHER}
"""All that can be hidden, by key."""


def name_of(key: str) -> str:
    """Return the name of the effect of which a key is a form."""
    return FORMS[key].name or key


def knob(name: str, strength: str | float) -> float:
    """Return the strength of an effect as a number."""
    return getattr(FORMS[name], strength) if isinstance(strength, str) else float(strength)


def drawn(name: str, seed: int) -> dict[str, float]:
    """Return the constants of a form that a seed draws, whatever else is hidden with it."""
    form = FORMS[name]
    rng = np.random.default_rng([seed, 20170511, form.column])
    return {what: float(rng.uniform(low, high)) for what, low, high in form.constants}
