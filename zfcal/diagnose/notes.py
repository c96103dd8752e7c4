"""What is to be doubted in a diagnosis: noise, halves, controls, what is left, the null."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from zfcal.arrays import Floats
from zfcal.diagnose.case import is_suspicious
from zfcal.diagnose.controls import ask_controls, control_names
from zfcal.diagnose.features.naming import Hidden
from zfcal.diagnose.findings import Note
from zfcal.diagnose.null import from_replicates, theory
from zfcal.diagnose.omnibus import Omnibus
from zfcal.diagnose.question import Question
from zfcal.diagnose.screening import Screen

_CONTROL = 4.5


def notes_of(
    question: Question,
    final: Screen,
    halves: Note,
    omnibus: Omnibus,
    replicates: Sequence[Floats | None],
) -> tuple[Note, ...]:
    """Return the notes of a diagnosis but for that of noise.

    Parameters
    ----------
    question
        Model, tracks, and how sure the answer is to be.
    final
        The model with all effects that stand.
    halves
        How far the fits of the two halves differ.
    omnibus
        Of the final model.
    replicates
        Negative controls of each replicate; None where they were not asked.
    """
    return (
        halves,
        _controls_note(question, final, replicates),
        _omnibus_note(question, final, omnibus),
        Note(
            name="null",
            says="Replicates of the fitted model through the measurement."
            if replicates
            else "The theory alone: tracking noise can pose as a turning memory.",
            values={"replicates": float(len(replicates))},
        ),
    )


def _omnibus_note(question: Question, final: Screen, omnibus: Omnibus) -> Note:
    text = f"Ranks of headings and speeds in the final model: largest is {omnibus.worst}."
    effects = " and ".join(final.fitted.parameters.effects)
    if effects and is_suspicious(question, omnibus):
        text += f" In these fish {effects} may have another form than in the model."
    return Note(name="omnibus", says=text, values={"z": omnibus.z, "p": omnibus.p})


def noise_note(question: Question, hidden: Sequence[Hidden]) -> Note:
    """Return the note of noise.

    Parameters
    ----------
    question
        Says by how much positions err, and who says so.
    hidden
        Effects that cannot be told from what noise makes.
    """
    if question.noise_m is None:
        text = "The noise of positions is not known; none was assumed."
        return Note(name="noise", says=text, values={})
    noise_mm = 1000 * question.noise_m
    text = f"Positions err by {noise_mm:.2g} mm per coordinate ({question.noise_source})."
    values = {"noise_m": question.noise_m}
    for each in hidden:
        at_mm = each.noise_share * noise_mm
        text += (
            f" Untestable at this noise: {each.name}. It gains {each.nats:.0f} nats, and noise "
            f"asks for {each.noise_nats:.0f} more than chance; it would be told at {at_mm:.1g} mm."
        )
        values[f"{each.name} testable_at_m"] = at_mm / 1000
    return Note(name="noise", says=text, values=values)


def _controls_note(question: Question, final: Screen, replicates: Sequence[Floats | None]) -> Note:
    z = ask_controls(final, question.seed)
    drawn = [controls for controls in replicates if controls is not None]
    null = from_replicates(np.array(drawn)) if drawn else theory(len(z))
    own = null.standardised(z)
    names = control_names()
    fired = [name for name, value in zip(names, own, strict=True) if abs(value) > _CONTROL]
    text = "Negative controls are silent, as they must be."
    if fired:
        text = f"NEGATIVE CONTROL FIRES: {', '.join(fired)}. Do not trust this diagnosis."
    return Note(name="controls", says=text, values=dict(zip(names, map(float, own), strict=True)))
