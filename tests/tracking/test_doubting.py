"""How far what is found can be believed, by what is found to the other side."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from zfcal.tracking.doubting import Doubts
from zfcal.tracking.learning import Standing


def found(sign, *masses):
    """Return what stands out to a side."""
    return [Standing(sign=sign, area_px=10.0, contrast=mass / 10) for mass in masses]


def test_before_a_look_all_is_believed():
    """There is nothing to doubt it by."""
    assert Doubts().trust(5.0) == 1.0


def test_trust_by_hand():
    """Of two as strong as 100 one is a decoy; of four as strong as 10, two and a weak one."""
    doubts = Doubts()
    doubts.look(found(-1, 10, 20, 100, 200) + found(1, 5, 15, 150))
    assert doubts.trust(60.0) == pytest.approx(1 - 1 / 2)
    assert doubts.trust(10.0) == pytest.approx(1 - 2 / 4)
    assert doubts.trust(1.0) == pytest.approx(1 - 3 / 4)
    # Stronger than half of them is as good as that half.
    assert doubts.trust(1e6) == doubts.trust(60.0)


def test_where_all_that_stands_out_does_so_to_the_other_side_nothing_is_believed():
    """And where nothing stands out at all."""
    wrong, empty = Doubts(), Doubts()
    wrong.look(found(1, 50, 60))
    empty.look([])
    assert wrong.trust(55.0) == empty.trust(55.0) == 0.0


def test_old_looks_are_forgotten():
    """Forty are remembered."""
    doubts = Doubts()
    doubts.look(found(1, 100))
    for _ in range(39):
        doubts.look(found(-1, 100))
    assert doubts.trust(100.0) == pytest.approx(1 - 1 / 39)
    doubts.look(found(-1, 100))
    assert doubts.trust(100.0) == 1.0


@pytest.mark.slow
@given(
    st.lists(st.floats(1, 1e4), max_size=20),
    st.lists(st.floats(1, 1e4), max_size=20),
    st.floats(1, 1e4),
)
def test_trust_is_a_share_and_decoys_lower_it(targets, decoys, mass):
    """Within [0, 1], and one decoy more that is stronger never raises it."""
    fewer, more = Doubts(), Doubts()
    fewer.look(found(-1, *targets) + found(1, *decoys))
    more.look(found(-1, *targets) + found(1, *decoys, 1e5))
    assert 0.0 <= more.trust(mass) <= fewer.trust(mass) <= 1.0
