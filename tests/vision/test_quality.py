"""What goes wrong while tracking is counted."""

import numpy as np

from zfcal.vision.quality import Tally
from zfcal.vision.seen import BadFrame, Seen


def seen(agent, *, shared=1, confidence=1.0):
    """Return a sighting."""
    return Seen(
        agent=agent,
        x_m=0.0,
        y_m=0.0,
        heading_rad=0.0,
        confidence=confidence,
        x_px=0.0,
        y_px=0.0,
        contour_px=np.empty((0, 2), np.int32),
        shared=shared,
    )


def test_drops_crowds_guesses_and_new_ids_are_counted_by_hand():
    """Four frames of two fish: one missing, one crowd, one guess, two ids that began later."""
    tally = Tally(2)
    tally.add([seen(0), seen(1)])
    tally.add([seen(0)], [BadFrame(number=1, time_s=0.1, reason="too few", says="")])
    tally.add([seen(0, shared=2), seen(2, shared=2, confidence=0.4)])
    tally.add([seen(2), seen(3)])

    found = tally.result()

    assert (found.frames, found.rows, found.drops, found.exact) == (4, 7, 1, 3)
    assert (found.merged, found.guesses, found.swaps) == (2, 1, 2)
    assert found.bad == {"too few": 1}


def test_without_a_number_of_fish_nothing_is_a_drop():
    """An empty frame may be an empty tank."""
    tally = Tally(None)
    tally.add([])
    tally.add([seen(5)])

    assert (tally.result().drops, tally.result().exact, tally.result().swaps) == (0, 0, 0)
