"""How drawn images look: light, bodies, sensor and compression, with units, and three presets."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

from zfcal.errors import InputError

CLEAN, USUAL, HARD = "clean", "usual", "hard"


@dataclass(frozen=True, slots=True, kw_only=True)
class Look:
    """How a tank looks in its two cameras. Grey levels go from 0 to 255.

    Parameters
    ----------
    floor_grey, wall_grey, outside_grey
        The water over the floor, the walls, and what lies behind them.
    uneven_light
        Share by which the darkest corner is darker than the brightest place.
    specks
        Dark specks and bubbles on the floor, per square metre.
    mottle_grey
        Standard deviation of the floor's own pattern.
    fish_length_m, fish_length_sd_m
        From snout to tip of the tail fin: mean and spread from fish to fish.
    fish_grey, tail_grey
        The back at the head, and at the root of the tail fin.
    fish_contrast_sd
        Spread from fish to fish of how much darker than the floor they are, as a share.
    fin_opacity
        Of the tail fin, which is no part of the silhouette.
    stripe_grey
        How much lighter the flanks are than the back.
    lure_length_m, lure_grey
        The robot's lure.
    shadow_opacity, shadow_offset_m, shadow_blur_m
        Of the shadows on the floor: share of light taken, where they fall, softness.
    reflection, reflection_reach_m
        How strongly the walls mirror a body, and how near to them it must be.
    glare_grey
        How much brighter the lamps' reflections on the water are.
    ripple_grey, ripple_m
        Standard deviation and size of the ripples on the water.
    flicker
        Standard deviation of the light from frame to frame, as a share.
    exposure_s
        Of one frame; positions are those of its middle.
    defocus_px
        Standard deviation of the lens's blur.
    noise_grey
        Standard deviation of the overhead camera's noise in a pixel and frame.
    jpeg_quality
        From 1 to 100; None for lossless PNG.
    led_colour_bgr
        Of the robots' LEDs: blue, green, red from 0 to 1. Further robots have it turned round.
    led_distance_m
        Between the two LEDs of a robot, which lie on its axis around its position.
    led_radius_m
        Of an LED's bright disc.
    led_halo
        Brightness of the glow around an LED, as a share of the LED's.
    led_reflection
        Brightness of an LED's reflection in the glass, as a share of the LED's.
    below_grey, below_noise_grey
        The tank from below, and that camera's noise.
    """

    floor_grey: float = 176.0
    wall_grey: float = 224.0
    outside_grey: float = 146.0
    uneven_light: float = 0.15
    specks: float = 60.0
    mottle_grey: float = 1.5
    fish_length_m: float = 0.037
    fish_length_sd_m: float = 0.0015
    fish_grey: float = 52.0
    tail_grey: float = 92.0
    fish_contrast_sd: float = 0.055
    fin_opacity: float = 0.25
    stripe_grey: float = 14.0
    lure_length_m: float = 0.045
    lure_grey: float = 34.0
    shadow_opacity: float = 0.12
    shadow_offset_m: tuple[float, float] = (0.007, -0.005)
    shadow_blur_m: float = 0.004
    reflection: float = 0.35
    reflection_reach_m: float = 0.045
    glare_grey: float = 12.0
    ripple_grey: float = 0.8
    ripple_m: float = 0.04
    flicker: float = 0.002
    exposure_s: float = 0.008
    defocus_px: float = 0.6
    noise_grey: float = 2.0
    jpeg_quality: int | None = 92
    led_colour_bgr: tuple[float, float, float] = (0.15, 1.0, 0.1)
    led_distance_m: float = 0.030
    led_radius_m: float = 0.003
    led_halo: float = 0.12
    led_reflection: float = 0.12
    below_grey: float = 44.0
    below_noise_grey: float = 3.0

    def __post_init__(self) -> None:
        for field in dataclasses.fields(self):
            _check(field.name, getattr(self, field.name))
        if not self.led_distance_m > 0 or not self.fish_length_m > 0:
            raise InputError(
                "fish_length_m and led_distance_m must be positive, got "
                f"{self.fish_length_m!r} and {self.led_distance_m!r}."
            )


def _check(name: str, value: object) -> None:
    if name == "jpeg_quality":
        if value is not None and not (isinstance(value, int) and 1 <= value <= 100):
            raise InputError(f"jpeg_quality must be 1 to 100, or none for PNG, got {value!r}.")
        return
    shares = ("opacity", "light", "reflection", "halo", "_bgr")
    limit = 255.0 if name.endswith("_grey") else 1.0 if name.endswith(shares) else math.inf
    signed = name == "shadow_offset_m"
    for number in value if isinstance(value, tuple) else (value,):
        if not (isinstance(number, int | float) and math.isfinite(number)):
            raise InputError(f"{name} must be a number, got {number!r}.")
        if not (signed or 0 <= number <= limit):
            raise InputError(f"{name} must be from 0 to {limit:g}, got {number!r}.")


PRESETS: Mapping[str, Look] = MappingProxyType(
    {
        CLEAN: Look(
            uneven_light=0.0,
            specks=0.0,
            mottle_grey=0.0,
            shadow_opacity=0.0,
            reflection=0.0,
            glare_grey=0.0,
            ripple_grey=0.0,
            flicker=0.0,
            noise_grey=0.0,
            jpeg_quality=None,
            led_halo=0.0,
            led_reflection=0.0,
            below_noise_grey=0.0,
        ),
        USUAL: Look(),
        HARD: Look(
            floor_grey=150.0,
            uneven_light=0.4,
            specks=250.0,
            mottle_grey=4.0,
            fish_grey=72.0,
            tail_grey=112.0,
            shadow_opacity=0.25,
            shadow_offset_m=(0.012, -0.009),
            reflection=0.6,
            glare_grey=40.0,
            ripple_grey=3.0,
            flicker=0.01,
            exposure_s=0.016,
            defocus_px=0.9,
            noise_grey=5.0,
            jpeg_quality=70,
            led_halo=0.3,
            led_reflection=0.35,
            below_grey=70.0,
            below_noise_grey=7.0,
        ),
    }
)
"""``clean``: nothing but bodies, lossless; ``usual``: like the rig's; ``hard``: a bad day."""


def look_of(preset: str, changes: Mapping[str, Any] | None = None) -> Look:
    """Return a preset with some of its values changed.

    Parameters
    ----------
    preset
        One of `PRESETS`.
    changes
        Values by the names of `Look`.

    Raises
    ------
    InputError
        There is no such preset or value, or a value is out of range.
    """
    if preset not in PRESETS:
        raise InputError(f"No preset {preset!r}.", hint=f"There are {', '.join(PRESETS)}.")
    names = {field.name for field in dataclasses.fields(Look)}
    for name in changes or {}:
        if name not in names:
            raise InputError(
                f"Drawn images have no {name!r}.", hint=f"There are {', '.join(sorted(names))}."
            )
    return dataclasses.replace(PRESETS[preset], **(changes or {}))
