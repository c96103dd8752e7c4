"""What is to be doubted in a diagnosis."""

from types import SimpleNamespace

import numpy as np
import pytest

from zfcal.diagnose import notes
from zfcal.diagnose.features.naming import Hidden
from zfcal.diagnose.findings import Note
from zfcal.diagnose.notes import noise_note, notes_of
from zfcal.diagnose.omnibus import Omnibus

NAMES = notes.control_names()
SILENT = np.zeros(len(NAMES))


@pytest.fixture
def noted(monkeypatch):
    """Return what takes the notes of a diagnosis: each by its name."""

    def of(effects=(), *, controls=SILENT, replicates=(), noise_m=0.0, omnibus_p=0.5, hidden=()):
        monkeypatch.setattr(notes, "ask_controls", lambda *_: controls)
        question = SimpleNamespace(seed=1, noise_m=noise_m, noise_source="asked for", quick=False)
        model = SimpleNamespace(effects=dict.fromkeys(effects))
        final = SimpleNamespace(fitted=SimpleNamespace(parameters=model))
        halves = Note(name="halves", says="", values={"largest": 1.0})
        omnibus = Omnibus(p=omnibus_p, worst="speed", z=6.0)
        made = notes_of(question, final, halves, omnibus, replicates)
        return {note.name: note for note in (noise_note(question, hidden), *made)}

    return of


@pytest.mark.parametrize(
    ("effects", "p", "says"),
    [((), 1e-9, False), (("crowding",), 1e-9, True), (("crowding",), 0.2, False)],
)
def test_what_is_left_beside_an_effect_may_be_its_form(noted, effects, p, says):
    """Where the ranks are still uneven with it in the model."""
    note = noted(effects, omnibus_p=p)["omnibus"]
    assert ("crowding may have another form" in note.says) == says
    assert note.values == {"z": 6.0, "p": p}


def test_a_control_that_fires_is_said(noted):
    """At five standard errors of the theory; of replicates that scatter as much it is none."""
    fired = np.where(np.arange(len(SILENT)) == 0, 5.0, 0.0)
    assert f"FIRES: {NAMES[0]}" in noted(controls=fired)["controls"].says
    drawn = [fired * sign for sign in (1.0, -1.0) * 5]
    assert "silent" in noted(controls=fired, replicates=drawn)["controls"].says
    assert "silent" in noted()["controls"].says


def test_replicates_are_counted_and_noise_is_told(noted):
    """In millimetres, with where it is from; what is not known is said."""
    told = noted(replicates=[None] * 6, noise_m=4e-4)
    assert told["null"].values == {"replicates": 6.0}
    assert "0.4 mm" in told["noise"].says
    assert "asked for" in told["noise"].says
    assert told["noise"].values == {"noise_m": 4e-4}
    unknown = noted(noise_m=None)
    assert "not known" in unknown["noise"].says
    assert "theory alone" in unknown["null"].says


def test_what_noise_hides_is_untestable_at_this_noise(noted):
    """With the noise at which it would be told, in metres among the values."""
    late = Hidden(name="reaction-delay", nats=25.0, noise_nats=40.0, noise_share=0.3)
    note = noted(noise_m=2e-3, hidden=[late])["noise"]
    assert "Untestable at this noise: reaction-delay. It gains 25 nats" in note.says
    assert "noise asks for 40 more than chance; it would be told at 0.6 mm" in note.says
    assert note.values["reaction-delay testable_at_m"] == pytest.approx(6e-4)
