"""A model that makes, through the measurement, what was fitted to measured tracks.

Noise of positions blurs headings: what is fitted to noisy tracks turns more than the fish did,
and simulated with the same noise on top it would turn more still. The null's replicates
would then hold less of what noise alone looks like than the recording does. So the model that
makes them is moved until its replicates are fitted as the recording was (indirect
inference: Gourieroux, Monfort and Renault 1993, Journal of Applied Econometrics 8: S85-S118).
"""

from __future__ import annotations

from dataclasses import replace

from zfcal.diagnose.heldout import own_speeds
from zfcal.diagnose.null import Chain
from zfcal.parameters import ZoneParameters

_PILOTS = 2
_FIRST = 100_000
"""Number of the first pilot: its seed is that of no replicate."""

_MOST = 4.0
"""Factor by which a parameter is moved at most."""


def sharpened(chain: Chain) -> Chain:
    """Return the chain with a model whose replicates are fitted as the recording was.

    Parameters
    ----------
    chain
        Its replicates are to be fitted as its fitted model, and to have the speeds of the model
        that it simulates, which are as measured.
    """
    fitted, limits_m_s = chain.fitted.parameters, chain.arena.bins.speed_m_s
    speeds = [zone.speed_frequency for zone in chain.simulated.zones]
    wanted = [
        replace(zone, speed_frequency=own) for zone, own in zip(fitted.zones, speeds, strict=True)
    ]
    for number in range(_PILOTS):
        pilot = chain.screen(_FIRST + number)
        found = own_speeds(pilot, pilot.fitted.parameters, limits_m_s)
        zones = [
            _moved(now, want, had)
            for now, want, had in zip(chain.simulated.zones, wanted, found.zones, strict=True)
        ]
        chain = replace(chain, maker=replace(chain.simulated, zones=tuple(zones)))
    return chain


def _moved(now: ZoneParameters, want: ZoneParameters, had: ZoneParameters) -> ZoneParameters:
    """Return a zone's parameters moved by what its replicate's fit lacks."""
    gamma = {
        name: _by_ratio(value, want.gamma[name], had.gamma[name])
        for name, value in now.gamma.items()
    }
    most = max(gamma.values())
    speeds = zip(now.speed_frequency, want.speed_frequency, had.speed_frequency, strict=True)
    return replace(
        now,
        kappa_0=_by_spread(now.kappa_0, want.kappa_0, had.kappa_0),
        kappa_f=_by_spread(now.kappa_f, want.kappa_f, had.kappa_f),
        alpha=_by_ratio(now.alpha, want.alpha, had.alpha),
        speed_frequency=_whole([_by_ratio(*each) for each in speeds]),
        gamma={name: value / most for name, value in gamma.items()} if most > 0 else gamma,
    )


def _by_spread(now: float, want: float, had: float) -> float:
    """Return a concentration whose angular variance, its inverse, is moved: variances add."""
    if not min(now, want, had) > 0.0:
        return now
    spread = 1 / now + 1 / want - 1 / had
    return min(max(1 / max(spread, 1e-9), want / _MOST), want * _MOST)


def _whole(shares: list[float]) -> tuple[float, ...]:
    total = sum(shares)
    return tuple(share / total for share in shares)


def _by_ratio(now: float, want: float, had: float) -> float:
    if not min(now, want, had) > 0.0:
        return now
    return min(max(now * want / had, want / _MOST), want * _MOST)
