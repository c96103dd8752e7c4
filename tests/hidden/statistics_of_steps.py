"""What effects do, told by statistics that ask no model.

Each statistic gives a value for every step and fish, NaN where it does not apply. Means over
blocks of a minute give the standard error.
"""

import math

import numpy as np

from hidden import geometry
from hidden.law import world_of
from hidden.worlds import two_rooms

WORLD = world_of(two_rooms())


class Steps:
    """Steps of the fish of a trial: arrays (step, fish), and (step, fish, other)."""

    def __init__(self, trial):
        xy, heading = trial.states_m, trial.heading_rad
        speed = np.linalg.norm(np.diff(xy, axis=0), axis=2) / 0.2
        self.truth = trial.truth
        self.states, self.xy, self.everybodys = xy, xy[1:-1], heading[1:-1]
        self.phi, self.theta = heading[1:-1, :4], heading[2:, :4]
        self.speed, self.last_speed = speed[1:, :4], speed[:-1]
        self.turn = wrap(self.theta - self.phi)
        self.last_turn = wrap(self.phi - heading[:-2, :4])
        zone = np.array([[geometry.zone_of(*p, WORLD) for p in row] for row in xy])
        self.zone, self.enters = zone[1:-1, :4], (zone[2:] == 1) & (zone[1:-1] != 1)
        self.room = np.where(self.xy[..., 1] > self.xy[..., 0], 0, 1)
        self.time_s = 0.2 * np.arange(1, len(xy) - 1)[:, None]
        gap = self.xy[:, None] - self.xy[:, :4, None]
        self.bearing = np.arctan2(gap[..., 1], gap[..., 0])
        self.away = np.hypot(gap[..., 0], gap[..., 1])
        self.away[:, range(4), range(4)] = np.inf

    def of_nearest(self, values):
        """Return the values (step, fish, other) of each fish's nearest other."""
        nearest = self.away.argmin(axis=2)[..., None]
        return np.take_along_axis(values, nearest, axis=2)[..., 0]

    def toward(self, x, y):
        """Return how well headings point to a point: the cosine."""
        to = np.arctan2(y - self.xy[:, :4, 1], x - self.xy[:, :4, 0])
        return np.cos(self.theta - to)


def wrap(angle):
    """Return angles in [-pi, pi)."""
    return (np.asarray(angle) + math.pi) % (2 * math.pi) - math.pi


def where(condition, values):
    """Return values, NaN where a condition fails."""
    return np.where(condition, values, np.nan)


def centred(values):
    """Return values less their mean."""
    return values - np.nanmean(values)


def turns_to_others(s):
    """Turning toward the mean heading of those within 12 cm, in the centre."""
    near = s.away < 0.12
    mean = np.angle((near * np.exp(1j * s.everybodys)[:, None]).sum(axis=2))
    side = np.sign(wrap(mean - s.phi))
    return where((s.zone == 3) & near.any(axis=2), np.sin(s.turn) * side)


def goes_on_along_wall(s):
    """Keeping the heading, in corridor and wall zone."""
    return where(s.zone != 3, np.cos(s.turn))


def heads_for_centroid(s):
    """Heading for the centroid of all others where it is more than 15 cm away."""
    x, y = ((s.xy.sum(axis=1)[:, None] - s.xy[:, :4]) / 4).transpose(2, 0, 1)
    away = np.hypot(x - s.xy[:, :4, 0], y - s.xy[:, :4, 1])
    return where(away > 0.15, s.toward(x, y))


def heads_for_nearest(low_m, high_m):
    """Heading for the nearest other, at such a distance and in view."""

    def statistic(s):
        away, bearing = s.of_nearest(s.away), s.of_nearest(s.bearing)
        seen = np.abs(wrap(bearing - s.phi)) < 2.3
        return where((away > low_m) & (away < high_m) & seen, np.cos(s.theta - bearing))

    return statistic


def heads_for_nearest_behind(s):
    """Heading for the nearest other at 105 to 135 degrees and 2 to 6 cm."""
    away, bearing = s.of_nearest(s.away), s.of_nearest(s.bearing)
    off = np.degrees(np.abs(wrap(bearing - s.phi)))
    chosen = (away > 0.02) & (away < 0.06) & (off > 105) & (off < 135)
    return where(chosen, np.cos(s.theta - bearing))


def prefers_the_fast(s):
    """Heading for others at 2 to 12 cm, times how fast they were."""
    fast = (s.last_speed - s.last_speed.mean())[:, None]
    near = (s.away > 0.02) & (s.away < 0.12)
    return np.where(near, fast * np.cos(s.theta[..., None] - s.bearing), 0).sum(axis=2)


def heads_for_the_past(s):
    """Heading for where others beyond 5 cm were 0.6 s ago rather than for where they are."""
    old = np.concatenate([np.repeat(s.states[:1], 3, axis=0), s.states])[1:-4]
    gap = old[:, None] - s.xy[:, :4, None]
    then = np.arctan2(gap[..., 1], gap[..., 0])
    better = np.cos(s.theta[..., None] - then) - np.cos(s.theta[..., None] - s.bearing)
    near = (s.away > 0.05) & (s.away < 0.2)
    return np.where(near, better, 0).sum(axis=2)


def follows_the_leaving(s):
    """Heading for the door in the 3 s after another left the room."""
    value = np.full(s.theta.shape, np.nan)
    left = np.full((2, s.enters.shape[1]), -1000)
    for t in range(len(s.theta)):
        for i in range(4):
            others = np.delete(left[s.room[t, i]], i)
            if s.zone[t, i] != 1 and t - others.max() < 15:
                x, y = WORLD.mouths[s.room[t, i]]
                to = math.atan2(y - s.xy[t, i, 1], x - s.xy[t, i, 0])
                value[t, i] = math.cos(s.theta[t, i] - to)
        for j in np.flatnonzero(s.enters[t]):
            left[s.room[t, j], j] = t + 1
    return value


def heads_for_place(s):
    """Heading for the liked place from less than 30 cm away."""
    x, y = s.truth["place_m"]
    near = np.hypot(s.xy[:, :4, 0] - x, s.xy[:, :4, 1] - y) < 0.3
    return where(near, s.toward(x, y))


def drifts(s):
    """Turning to the side that the current flows to, in the centre."""
    return where(s.zone == 3, np.sin(s.turn) * np.sin(s.truth["compass_rad"] - s.phi))


def turns_left(s):
    """Turning to the left in the centre."""
    return where(s.zone == 3, np.sin(s.turn))


def turns_on(s):
    """Turning to the side of the last turn, in the centre."""
    fits = (s.zone == 3) & (np.abs(s.last_turn) < 1.2)
    return where(fits, np.sin(s.turn) * np.sign(s.last_turn))


def matches_speed(s):
    """Product of the speed and that of the two nearest before."""
    near = np.argsort(s.away, axis=2)[..., :2]
    pace = np.take_along_axis(s.last_speed[:, None], near, axis=2).mean(axis=2)
    return centred(s.speed) * centred(pace)


def speeds_up_in_crowds(s):
    """Product of the speed and the number of others within 10 cm."""
    return centred(s.speed) * centred((s.away < 0.10).sum(axis=2))


def swims_as_before(s):
    """Product of successive speeds."""
    return centred(s.speed) * centred(s.last_speed[:, :4])


def swims_fast_in_turns(s):
    """Product of the speed and the turn's size."""
    return centred(s.speed) * centred(np.abs(s.turn))


def stands(s):
    """Coming to a stand of two steps or more."""
    still = s.speed < 0.002
    begins = still[:-1] & still[1:] & (s.last_speed[:-1, :4] >= 0.002)
    return begins.astype(float)


def swims_fast_late(s):
    """Speed in the second half less that in the first, pair of steps by pair of steps."""
    half = len(s.speed) // 2
    return s.speed[half : 2 * half] - s.speed[:half]


def follows_late(s):
    """Heading for the nearest in the second half less that in the first."""
    follows = heads_for_nearest(0.02, 0.2)(s)
    half = len(follows) // 2
    late, early = (np.nanmean(part.reshape(15, -1), axis=1) for part in
                   (follows[half : half + 4485], follows[:4485]))  # fmt: skip
    return (late - early)[:, None]


def bold_leave(s):
    """Entering the corridor, times the fish's own boldness."""
    return where(s.zone != 1, s.enters[:, :4] * np.array(s.truth["bold"][:4]))


def heads_for_robot(s):
    """Heading for the robot at 2 to 12 cm."""
    near = (s.away[..., 4] > 0.02) & (s.away[..., 4] < 0.12)
    return where(near, np.cos(s.theta - s.bearing[..., 4]))


def leaves_walls_in_time(s):
    """Going straight on across the wall's direction, in the rhythm of four minutes."""
    along = np.array([[geometry.wall_rad(*p, WORLD) for p in row[:4]] for row in s.xy])
    rhythm = np.sin(2 * math.pi * s.time_s / 240 + s.truth["phase_rad"])
    across = (s.zone != 3) & (np.abs(np.sin(s.phi - along)) > 0.6)
    return rhythm * centred(where(across, np.cos(s.turn)))


def darts_together(s):
    """Swimming fast when another within 15 cm swam fast."""
    fast = (s.last_speed > 0.14)[:, None] & (s.away < 0.15)
    return where(fast.any(axis=2), s.speed > 0.14)


def flees_the_sound(s):
    """Heading away from the loudspeaker's corner while it sounds."""
    sounds = (np.rint(s.time_s / 0.2) + 150) % 300 < 15
    return where(sounds, -s.toward(0.051, 0.949))


def follows_on_the_left(s):
    """Heading for the nearest at 2 to 15 cm, on the left less on the right."""
    away, bearing = s.of_nearest(s.away), s.of_nearest(s.bearing)
    side = wrap(bearing - s.phi)
    near = (away > 0.02) & (away < 0.15) & (np.abs(side) < 2.3)
    return where(near, np.cos(s.theta - bearing) * np.sign(side))


def swims_fast_in_light(s):
    """Speed in the lit room less that in the other."""
    return where(s.zone != 1, np.where(s.room[:, :4] == 0, 1, -1) * centred(s.speed))


STATISTICS = {
    "alignment": (1, turns_to_others),
    "wall-persistence": (1, goes_on_along_wall),
    "group-cohesion": (1, heads_for_centroid),
    "interaction-range": (-1, heads_for_nearest(0.15, 0.35)),
    "rear-blind-zone": (-1, heads_for_nearest_behind),
    "leader-following": (1, prefers_the_fast),
    "reaction-delay": (1, heads_for_the_past),
    "collective-departure": (1, follows_the_leaving),
    "place-preference": (1, heads_for_place),
    "directional-drift": (1, drifts),
    "turning-bias": (1, turns_left),
    "turning-memory": (1, turns_on),
    "speed-matching": (1, matches_speed),
    "crowding": (-1, speeds_up_in_crowds),
    "burst-and-coast": (1, swims_as_before),
    "speed-turn-coupling": (-1, swims_fast_in_turns),
    "freezing": (1, stands),
    "fatigue": (-1, swims_fast_late),
    "habituation": (-1, follows_late),
    "boldness": (1, bold_leave),
    "robot-avoidance": (-1, heads_for_robot),
    "waxing-walls": (1, leaves_walls_in_time),
    "startle": (1, darts_together),
    "sound": (1, flees_the_sound),
    "kept-distance": (-1, heads_for_nearest(0.02, 0.08)),
    "one-eye": (1, follows_on_the_left),
    "lit-room": (1, swims_fast_in_light),
}


def blocks(values):
    """Return the means of a statistic over minutes."""
    size = min(300, len(values))
    cut = values[: len(values) // size * size] if len(values) > 300 else values
    parts = cut.reshape(-1, size * cut.shape[1]) if len(values) > 300 else cut
    means = np.array([np.nanmean(p) for p in parts if np.isfinite(p).any()])
    return means[np.isfinite(means)]


def standing_out(told, steps, base_steps):
    """Return by how many standard errors a statistic, with its sign, exceeds the base's."""
    sign, statistic = told
    a, b = (blocks(statistic(s)) for s in (steps, base_steps))
    error = math.sqrt(a.var(ddof=1) / len(a) + b.var(ddof=1) / len(b))
    return sign * (a.mean() - b.mean()) / error
