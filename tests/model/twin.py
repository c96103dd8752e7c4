"""The model's one-step density, slow and obvious: formulas of the model on plain numbers.

It shares nothing with the compiled kernel but the arena's geometry, which it
asks of shapely, and the parameters.
"""

from __future__ import annotations

import itertools
import math

import numpy as np
import shapely
import shapely.ops
from scipy.special import i0


def von_mises(theta, mu, kappa):
    """Density of the von Mises law."""
    return np.exp(kappa * np.cos(theta - mu)) / (2 * math.pi * i0(kappa))


def triangle_solid_angle(a, b, c):
    """Solid angle of a triangle from the origin, by the angles of the spherical triangle."""
    a, b, c = (np.asarray(v) / np.linalg.norm(v) for v in (a, b, c))
    sides = [math.atan2(np.linalg.norm(np.cross(p, q)), p @ q) for p, q in ((b, c), (c, a), (a, b))]
    half = sum(sides) / 2
    product = math.tan(half / 2)
    for side in sides:
        product *= max(0.0, math.tan((half - side) / 2))
    return 4 * math.atan(math.sqrt(max(0.0, product)))  # L'Huilier


def body_solid_angle(observer, head, heading):
    """Solid angle of a flat diamond of 20 x 20 x 10 mm seen from a point."""
    length, width, height = 0.02, 0.02, 0.01
    h = np.array([math.cos(heading), math.sin(heading), 0.0])
    side = np.array([-h[1], h[0], 0.0])
    up = np.array([0.0, 0.0, 1.0])
    nose = np.array([*head, 0.0]) - np.array([*observer, 0.0])
    middle = nose - length / 3 * h
    flat = [nose, nose - length * h, middle + width / 2 * side, middle - width / 2 * side]
    top, bottom = middle + height / 2 * up, middle - height / 2 * up

    def azimuth_difference(pair):
        turn = math.atan2(pair[0][1], pair[0][0]) - math.atan2(pair[1][1], pair[1][0])
        return abs((turn + math.pi) % (2 * math.pi) - math.pi)

    a, b = max(itertools.combinations(flat, 2), key=azimuth_difference)
    return triangle_solid_angle(a, top, b) + triangle_solid_angle(a, b, bottom)


def wall_direction(arena, point):
    """Angle perpendicular to the line to the nearest point of the wall."""
    walls = shapely.MultiLineString([ring.tolist() for ring in arena.rings_m])
    onto = shapely.ops.nearest_points(walls, shapely.Point(point))[0]
    return math.atan2(onto.y - point[1], onto.x - point[0]) + math.pi / 2


def mixture(agent, xy, heading, parameters, arena):
    """The mixture m before the attraction of zones: weight, mean and kappa of each component."""
    zone_id = int(arena.zone_of(xy[agent]))
    zone = parameters.zones[zone_id - 1]
    if arena.zones[zone_id - 1].follows_walls:
        tau = wall_direction(arena, xy[agent])
        kappa_w = zone.kappa_0 if zone.kappa_w is None else zone.kappa_w
        parts = [(0.5, tau, kappa_w), (0.5, tau + math.pi, kappa_w)]
    else:
        parts = [(1.0, heading[agent], zone.kappa_0)]
    for j in range(len(xy)):
        dx, dy = xy[j][0] - xy[agent][0], xy[j][1] - xy[agent][1]
        bearing = math.atan2(dy, dx)
        off_axis = abs((bearing - heading[agent] + math.pi) % (2 * math.pi) - math.pi)
        if j == agent or off_axis > parameters.fov_rad:
            continue
        mu = bearing + math.pi if math.hypot(dx, dy) < 0.02 else bearing
        angle = body_solid_angle(xy[agent], xy[j], heading[j])
        parts.append((zone.alpha * angle, mu, zone.kappa_f))
    total = sum(weight for weight, _, _ in parts)
    return [(weight / total, mu, kappa) for weight, mu, kappa in parts]


def density(agent, xy, heading, speed, parameters, arena, n=360):
    """The density of the next heading on n + 1 angles from -pi to pi, by the trapezoid."""
    thetas = np.linspace(-math.pi, math.pi, n + 1)
    zone = parameters.zones[int(arena.zone_of(xy[agent])) - 1]
    parts = mixture(agent, xy, heading, parameters, arena)
    reach = speed * parameters.dt_s
    directions = np.column_stack([np.cos(thetas), np.sin(thetas)])
    landing = arena.zone_of(np.asarray(xy[agent]) + reach * directions)
    attraction = np.array([0.0] + [zone.gamma[name] for name in arena.zone_names])[landing]
    values = attraction * sum(weight * von_mises(thetas, mu, kappa) for weight, mu, kappa in parts)
    total = np.trapezoid(values, thetas)
    return thetas, values / total if total > 0 else values
