"""Features in place of forms: what an effect's name means for a heading, whatever its form.

Nobody knows the form in which fish have an effect: a stimulus may be one more component of the
mixture or a preference that all headings have, near or far, by what is seen or by who is next. So
a name is a set of features here. Each has weights by hat functions of a distance, a bearing, a
speed or the time, each weight with a strength of its own. A few strengths of some features
together come near to any form that the name may have.

The files of effects say which features theirs are. How they are fitted stands in
`zfcal.diagnose.features`.
"""

from __future__ import annotations

from zfcal.model.features.seen import AWAY_M, LAGS, SOON, Seen
from zfcal.model.features.sorts import (
    MOST_SHARPER,
    Along,
    Choosable,
    Component,
    Feature,
    Landing,
    Leaving,
    Mixed,
    OneOf,
    Sharper,
    Single,
    Tilt,
    Turned,
    Weights,
)

__all__ = [
    "AWAY_M",
    "LAGS",
    "MOST_SHARPER",
    "SOON",
    "Along",
    "Choosable",
    "Component",
    "Feature",
    "Landing",
    "Leaving",
    "Mixed",
    "OneOf",
    "Seen",
    "Sharper",
    "Single",
    "Tilt",
    "Turned",
    "Weights",
]
