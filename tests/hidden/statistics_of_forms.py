"""What further forms do, told without a model: which statistic, and on which side of the base's."""

import numpy as np

from hidden.statistics_of_steps import (
    centred,
    drifts,
    follows_late,
    goes_on_along_wall,
    heads_for_centroid,
    heads_for_nearest,
    heads_for_nearest_behind,
    heads_for_place,
    heads_for_robot,
    heads_for_the_past,
    matches_speed,
    speeds_up_in_crowds,
    stands,
    swims_as_before,
    swims_fast_late,
    turns_left,
    turns_on,
    turns_to_others,
)


def constant(s, key):
    """Return a form's first constant that the seed drew; a usual one where it is not hidden."""
    usual = {"leader-following/one-leader": 0.3, "burst-and-coast/rhythm": 1.6}
    return next(iter(s.truth["constants"].get(key, {}).values()), usual.get(key))


def heads_for_leader(s):
    """Heading for the leader at 2 to 20 cm, less that for others so near."""
    leader = int(4 * constant(s, "leader-following/one-leader"))
    near = (s.away > 0.02) & (s.away < 0.2)
    pull = np.where(near, np.cos(s.theta[..., None] - s.bearing), np.nan)
    values = np.where(np.arange(5) == leader, pull, -pull / 3)
    values = np.nansum(values, axis=2)
    values[:, leader] = np.nan
    return values


def leaves_after_others(s):
    """Entering the corridor in the 6 s after another left the room."""
    value = np.full(s.theta.shape, np.nan)
    left = np.full((2, s.enters.shape[1]), -1000)
    for t in range(len(s.theta)):
        for i in range(4):
            others = np.delete(left[s.room[t, i]], i)
            if s.zone[t, i] != 1 and t - others.max() < 30:
                value[t, i] = s.enters[t, i]
        for j in np.flatnonzero(s.enters[t]):
            left[s.room[t, j], j] = t + 1
    return value


def swings(s):
    """Product of the speed and what the drawn rhythm makes of the last two."""
    angle, last = constant(s, "burst-and-coast/rhythm"), centred(s.last_speed[:, :4])
    return centred(s.speed)[1:] * (np.cos(angle) * last[1:] - np.sin(angle) * last[:-1])


def swims_fast_after_turns(s):
    """Product of the speed and the last turn's size."""
    return centred(s.speed) * centred(np.abs(s.last_turn))


def creeps(s):
    """Three slow steps one after another."""
    slow = s.speed < 0.015
    return (slow[2:] & slow[1:-1] & slow[:-2]).astype(float)


def bold_are_out(s):
    """Being in the centre, times the fish's own boldness."""
    return (s.zone == 3) * np.array(s.truth["bold"][:4])


FORM_STATISTICS = {
    "alignment/flow": (1, turns_to_others),
    "alignment/nearest": (1, turns_to_others),
    "wall-persistence/recent-sense": (1, goes_on_along_wall),
    "group-cohesion/centroid": (1, heads_for_centroid),
    "group-cohesion/regain": (1, heads_for_nearest(0.2, 0.6)),
    "interaction-range/decay": (-1, heads_for_nearest(0.15, 0.35)),
    "rear-blind-zone/cardioid": (-1, heads_for_nearest_behind),
    "leader-following/one-leader": (1, heads_for_leader),
    "reaction-delay/snapshot": (1, heads_for_the_past),
    "collective-departure/quorum": (1, leaves_after_others),
    "place-preference/home": (1, heads_for_place),
    "directional-drift/bend": (1, drifts),
    "turning-bias/sides": (1, turns_left),
    "turning-memory/leaky": (1, turns_on),
    "turning-memory/alternation": (-1, turns_on),
    "speed-matching/company": (1, matches_speed),
    "speed-matching/nearest": (1, matches_speed),
    "crowding/nearest": (-1, speeds_up_in_crowds),
    "crowding/jostle": (1, speeds_up_in_crowds),
    "burst-and-coast/glide": (1, swims_as_before),
    "burst-and-coast/rhythm": (1, swings),
    "speed-turn-coupling/after-turn": (-1, swims_fast_after_turns),
    "freezing/shy": (1, stands),
    "freezing/crawl": (1, creeps),
    "fatigue/sudden": (-1, swims_fast_late),
    "fatigue/uneven": (-1, swims_fast_late),
    "habituation/sudden": (-1, follows_late),
    "boldness/centre": (1, bold_are_out),
    "robot-avoidance/flee": (-1, heads_for_robot),
}
