"""What can be hidden in a trial, in which form, and how strong.

Strengths are calibrated on trials of 30 minutes with 4 fish and a robot (seeds 9000 to
9002): the median of what an oracle sees is about 20 to 50 nats of a faint effect, 120 to
250 of a clear one and more than 600 of a strong one. Not so: a sound reaches 330 nats at
most; rare events (freezing, startle) scatter by the number that happen; a current's
nats are approximate, since a step that it moved has no exact speed of its own.
"""

from __future__ import annotations

from dataclasses import dataclass

from hidden import states

HEADING, SPEED, BOTH = "heading", "speed", "heading and speed"


@dataclass(frozen=True, slots=True, kw_only=True)
class Effect:
    """An effect.

    Parameters
    ----------
    column
        Its place in a plan's strengths.
    on
        What it acts on: this decides which densities its oracle compares.
    faint, clear, strong
        Its knob.
    form
        What it does, in one line.
    listed
        Whether it is one of the effects that the tool knows by name.
    name
        The effect of which this is a form; its key if that is its own.
    also
        Other listed names by which the form could rightly be called.
    constants
        Names and ranges of what is drawn uniformly by the seed.
    """

    column: int
    on: str
    faint: float
    clear: float
    strong: float
    form: str
    listed: bool = True
    name: str = ""
    also: tuple[str, ...] = ()
    constants: tuple[tuple[str, float, float], ...] = ()


def _effect(column, on, strengths, form, *, listed=True):
    faint, clear, strong = strengths
    return Effect(
        column=column, on=on, faint=faint, clear=clear, strong=strong, form=form, listed=listed
    )


K = states
EFFECTS = {
    "alignment": _effect(
        K.ALIGNMENT, HEADING, (0.025, 0.054, 0.12),
        "the base heading is rotated by a share of the way to the mean heading of the others "
        "within 12 cm; along a wall the sense of travel nearer to it is preferred",
    ),
    "wall-persistence": _effect(
        K.WALL_PERSISTENCE, HEADING, (0.1, 0.21, 0.4),
        "the two senses along a wall weigh (1 + p) / 2 and (1 - p) / 2 by the present one",
    ),
    "group-cohesion": _effect(
        K.GROUP_COHESION, HEADING, (0.7, 1.8, 5.0),
        "headings within 90 degrees of the centroid of all others, seen or not, weigh up to "
        "1 + w (1 - exp(-d / 0.2 m)) times more",
    ),
    "interaction-range": _effect(
        K.INTERACTION_RANGE, HEADING, (0.33, 0.22, 0.14),
        "neighbours farther than R metres do not exist",
    ),
    "rear-blind-zone": _effect(
        K.REAR_BLIND_ZONE, HEADING, (0.27, 0.49, 0.84),
        "neighbours behind about 95 degrees are dimmed by a share, over a border 10 degrees soft",
    ),
    "leader-following": _effect(
        K.LEADER_FOLLOWING, HEADING, (0.2, 0.42, 1.0),
        "a neighbour's solid angle times twice a logistic of its last speed, about 8 cm/s",
    ),
    "reaction-delay": _effect(
        K.REACTION_DELAY, HEADING, (0.03, 0.11, 0.28),
        "a share of the attraction of neighbours beyond 5 cm is toward where they were 0.6 s ago",
    ),
    "collective-departure": _effect(
        K.COLLECTIVE_DEPARTURE, HEADING, (1.2, 2.7, 7.0),
        "for 3 s after another left the room, directions to the door weigh more, and so does the "
        "corridor, less and less",
    ),
    "place-preference": _effect(
        K.PLACE_PREFERENCE, HEADING, (0.085, 0.2, 0.4),
        "a heading weighs by how far the landing point climbs a hill of liking 0.3 m wide",
    ),
    "directional-drift": _effect(
        K.DIRECTIONAL_DRIFT, BOTH, (0.0026, 0.0037, 0.0075),
        "a current of so many m/s is added to every step that stays inside",
    ),
    "turning-bias": _effect(
        K.TURNING_BIAS, HEADING, (0.028, 0.055, 0.11),
        "the base heading is rotated to the left by so many radians",
    ),
    "turning-memory": _effect(
        K.TURNING_MEMORY, HEADING, (0.08, 0.15, 0.35),
        "the base heading is rotated by a share of the last turn, if that was less than 69 degrees",
    ),
    "speed-matching": _effect(
        K.SPEED_MATCHING, SPEED, (0.07, 0.13, 0.22),
        "the speed is a weighted mean of one's own draw and the pace of the two nearest",
    ),
    "crowding": _effect(
        K.CROWDING, SPEED, (-0.016, -0.029, -0.06),
        "the speed times 1 + c n, n the number of others within 10 cm",
    ),
    "burst-and-coast": _effect(
        K.BURST_AND_COAST, SPEED, (0.055, 0.11, 0.2),
        "the normal scores of successive speeds are autocorrelated",
    ),
    "speed-turn-coupling": _effect(
        K.SPEED_TURN_COUPLING, BOTH, (0.07, 0.13, 0.25),
        "the speed times 1 - c |turn| / pi",
    ),
    "freezing": _effect(
        K.FREEZING, SPEED, (0.0004, 0.0008, 0.003),
        "at so many times a second a fish stops, for 2 s in the mean",
    ),
    "fatigue": _effect(
        K.FATIGUE, SPEED, (0.075, 0.14, 0.28),
        "the speed decays by exp(-r t / 30 min)",
    ),
    "habituation": _effect(
        K.HABITUATION, HEADING, (0.42, 0.75, 1.1),
        "the weight of neighbours falls linearly with time, to 1 - h after 30 min",
    ),
    "boldness": _effect(
        K.BOLDNESS, HEADING, (0.38, 0.75, 2.1),
        "each fish's attraction to the corridor, and its leaning to a door within 15 cm, are "
        "multiplied by exp(s z), z its own",
    ),
    "robot-avoidance": _effect(
        K.ROBOT_AVOIDANCE, HEADING, (0.23, 0.45, 0.8),
        "the robot's solid angle is reduced by a share; beyond 1 the fish turn away from it",
    ),
    "waxing-walls": _effect(
        K.WAXING_WALLS, HEADING, (0.036, 0.1, 0.23),
        "along a wall the fish go straight on instead, a share that waxes and wanes in 4 min",
        listed=False,
    ),
    "startle": _effect(
        K.STARTLE, BOTH, (0.0028, 0.0048, 0.013),
        "at so many times a second a fish darts for 0.6 s at 14 to 20 cm/s; others within 15 cm "
        "of one that begins to dart follow with probability 0.6",
        listed=False,
    ),
    "sound": _effect(
        K.SOUND, HEADING, (1.3, 4.0, 40.0),
        "every minute, for 3 s, directions away from a loudspeaker weigh up to 1 + b times more",
        listed=False,
    ),
    "kept-distance": _effect(
        K.KEPT_DISTANCE, HEADING, (0.24, 0.4, 0.65),
        "neighbours at 2 to 8 cm attract less by a share; beyond 1 they repel",
        listed=False,
    ),
    "one-eye": _effect(
        K.ONE_EYE, HEADING, (0.22, 0.4, 0.65),
        "neighbours on the right weigh less by a share",
        listed=False,
    ),
    "lit-room": _effect(
        K.LIT_ROOM, SPEED, (0.048, 0.1, 0.2),
        "in the upper left half of the tank the fish swim faster by a share",
        listed=False,
    ),
}  # fmt: skip

LISTED = tuple(name for name, effect in EFFECTS.items() if effect.listed)
UNLISTED = tuple(name for name, effect in EFFECTS.items() if not effect.listed)
