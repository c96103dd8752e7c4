"""Importing: what is written comes back, whatever the order, the scale or the origin."""

from pathlib import Path

import hypothesis.strategies as st
import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis.extra.numpy import arrays

from zfcal.errors import InputError
from zfcal.readers import ImportOptions, import_foreign
from zfcal.readers.assemble import assemble
from zfcal.readers.pickles import load_plain
from zfcal.readers.raw import Grid

HERE = Path("tracks.npy")

shapes = st.tuples(st.integers(1, 6), st.integers(1, 4), st.just(2))
positions = arrays(np.float64, shapes, elements=st.floats(0, 1000, width=32) | st.just(np.nan))


def _grid(xy, frame=None):
    frame = np.arange(len(xy)) if frame is None else frame
    return Grid(xy=xy, frame=frame, time_s=frame / 15, unit="px")


def _seen(xy):
    seen = np.isfinite(xy).all(axis=-1)
    assume(seen.any())
    return seen


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Return a folder for files that are written again for each example."""
    return tmp_path_factory.mktemp("foreign")


@given(xy=positions)
def test_csv_brings_back_every_position_that_was_seen(xy, folder):
    """Exactly, one row for each, and none for those that were not."""
    seen = _seen(xy)
    path = folder / "tracks.csv"
    lines = ["frame,agent,x_px,y_px"]
    for frame, agents in enumerate(xy.tolist()):
        lines += [f"{frame},{agent},{x!r},{y!r}" for agent, (x, y) in enumerate(agents)]
    path.write_text("\n".join(lines))

    tracks = import_foreign(path, "csv", ImportOptions(fps=15.0, m_per_px=0.01)).tracks

    frames, agents = np.nonzero(seen)
    assert tracks.frame.tolist() == frames.tolist()
    assert tracks.agent.tolist() == agents.tolist()
    assert tracks.x_m.tolist() == (xy[seen][:, 0] * 0.01).tolist()
    assert tracks.y_m.tolist() == (xy[seen][:, 1] * 0.01).tolist()


@given(xy=positions, scale=st.floats(1e-5, 1e-2), origin=st.tuples(*[st.floats(-100, 100)] * 2))
def test_distances_grow_with_the_scale_and_forget_the_origin(xy, scale, origin):
    """Moving or mirroring the axes moves no animal away from another."""
    _seen(xy)
    rows = _grid(xy).rows()

    plain = assemble(HERE, rows, ImportOptions(fps=15.0, m_per_px=0.001)).tracks
    moved = assemble(
        HERE, rows, ImportOptions(fps=15.0, m_per_px=scale, origin=origin, flip_y=True)
    ).tracks

    ratio = scale / 0.001
    assert np.diff(moved.x_m) == pytest.approx(ratio * np.diff(plain.x_m), abs=1e-9)
    assert np.diff(moved.y_m) == pytest.approx(-ratio * np.diff(plain.y_m), abs=1e-9)


@given(xy=positions, seed=st.integers(0, 100))
def test_the_order_of_rows_in_a_file_is_of_no_consequence(xy, seed):
    """Sorted by frame, then agent, in the end."""
    _seen(xy)
    rows = _grid(xy).rows()
    order = np.random.default_rng(seed).permutation(len(rows.frame))
    columns = ("time_s", "frame", "agent", "x", "y")
    mixed = type(rows)(**{name: getattr(rows, name)[order] for name in columns}, unit="px")
    options = ImportOptions(fps=15.0, m_per_px=0.001)

    one, other = assemble(HERE, rows, options).tracks, assemble(HERE, mixed, options).tracks

    for name in ("time_s", "frame", "agent", "x_m", "y_m"):
        assert getattr(one, name).tolist() == getattr(other, name).tolist()


@given(data=st.binary(max_size=200))
def test_any_bytes_as_a_pickle_are_plain_data_or_an_input_error(data):
    """No other exception, no crash."""
    try:
        load_plain(HERE, data)
    except InputError:
        return


@given(text=st.text(alphabet="0123456789.,-e\n\tnaif\"'xyt_ms", max_size=300))
def test_any_text_as_csv_is_tracks_or_an_input_error(text, folder):
    """Below a right header, whatever stands there."""
    path = folder / "any.csv"
    path.write_text("time_s,agent,x_m,y_m\n" + text)

    try:
        tracks = import_foreign(path, "csv", ImportOptions(fps=15.0)).tracks
    except InputError:
        return
    assert np.isfinite(tracks.x_m).all()
