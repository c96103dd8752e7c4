"""What is added to a model after a look at one of its laws: one effect, or none."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Protocol

from zfcal.arena import Arena
from zfcal.diagnose.beyond import Unfeatured, is_featured
from zfcal.diagnose.features.naming import Answer, Told
from zfcal.diagnose.looks import Found, is_other_form, outdoes
from zfcal.diagnose.naming import SURE, Refit
from zfcal.diagnose.screening import Screen
from zfcal.diagnose.selection import GENERIC_SHARE, LEAST_SHARE, UNNAMED_LEVEL, Step
from zfcal.diagnose.steadiness import Of


class Look(Protocol):
    """A look at what the law of speeds, or that of headings, lacks in a model."""

    @property
    def screen(self) -> Screen:
        """The model."""

    @property
    def on_speed(self) -> bool:
        """Whether it is at speeds."""

    @property
    def has_features(self) -> bool:
        """Whether features can be asked."""

    @property
    def may_doubt(self) -> bool:
        """Whether what no form bears out is something: nothing else can make features gain."""

    @property
    def of(self) -> Of:
        """The recording, and the sample in which each step of the features begins."""

    def ask(self) -> Answer:
        """Return which name it is, and which ones noise hides."""

    def explained(self, told: Told) -> Told:
        """Return a name with what explains it, and without ties that say nothing beside it."""

    def borne_out(self, told: Told, guess: Step | None) -> Step | None:
        """Return a name as an effect in the model; None where nothing bears it out."""

    def not_left_over(self, guess: Step | None) -> Step | None:
        """Return an effect beyond the list, unless what is there leaves it over."""


def further(look: Look, unfeatured: Unfeatured, there: Sequence[Refit], nats: float = 0.0) -> Found:
    """Return what is added to a model: one effect, or none.

    A further effect has to gain a share of what the clearest one does. What explains a name is
    asked where that name may be added, or keep out an effect beyond the list: not where that one
    leads all features.

    Parameters
    ----------
    look
        At the model.
    unfeatured
        What has no features.
    there
        What was added before after looks like this.
    nats
        What the clearest of it gains by features.
    """
    most = max([nats, *(each.nats for each in there)]) if there else 0.0
    least = most * share_of(there)
    guess = None
    if may_guess(there, look.screen.scene.arena):
        guess = unfeatured.beyond(look.screen, on_speed=look.on_speed, least=GENERIC_SHARE * most)
        guess = look.not_left_over(guess)
    plain = unfeatured.listed_one(
        look.screen, on_speed=look.on_speed, least=least, has_features=look.has_features
    )
    said = look.ask()
    told, may_be = said.told, said.told is not None and said.told.gain.nats >= least
    if told is not None and (may_be or guess is not None):
        told = _explained(look, told, guess)
    named = _borne_out(look, told, guess) if told is not None and may_be else None
    added = chosen(told, named, plain, guess, look.of)
    if told is not None and may_be and told is said.told and added is not guess:
        # A form of what is told gains as much as what leads its features.
        told = look.explained(told)
        named = _borne_out(look, told, guess)
        added = chosen(told, named, plain, guess, look.of)
    if added is None:
        is_sure = told is not None and _least_p(told) < UNNAMED_LEVEL
        return Found(suspicious=is_sure and look.may_doubt, hidden=said.hidden)
    if told is None or added is not named:
        return Found(steps=(added,), hidden=said.hidden)
    return Found(
        steps=(added,),
        nats=told.gain.nats,
        without_noise=told.gain.without_noise,
        hidden=said.hidden,
    )


def share_of(there: Sequence[Refit]) -> float:
    """Return the share of the clearest one's nats that a further effect has to gain.

    One beyond the list has no features: its own form is a guess, and leaves more over.
    """
    return GENERIC_SHARE if any(each.is_generic for each in there) else LEAST_SHARE


def may_guess(there: Sequence[Refit], arena: Arena) -> bool:
    """Return whether effects beyond the list are asked: until features, or one of these, named one.

    Parameters
    ----------
    there
        What was named.
    arena
        Of the tank.
    """
    return not any(
        each.is_generic or is_featured(each.candidate.effect, arena) for each in there
    )  # fmt: skip


def _explained(look: Look, told: Told, guess: Step | None) -> Told:
    """Return a name with what explains it; as it is where an effect beyond the list leads anyway.

    That is no other form of what explains it either.
    """
    if guess is None or not _leads(guess, told, look.of):
        return look.explained(told)
    forms = tuple(each for each in told.others if is_other_form(guess, each))
    if forms and look.explained(replace(told, others=forms, ties=())).cause is not None:
        return look.explained(told)
    return told


def _leads(guess: Step, told: Told, of: Of) -> bool:
    """Return whether an effect beyond the list gains clearly more than features of any listed one.

    It is no other form of what these name.
    """
    return not is_other_form(guess, told) and outdoes(guess, told.gain.log_p, told.gain.nats, of)


def _borne_out(look: Look, told: Told, guess: Step | None) -> Step | None:
    """Return what explains a name, or else that name, as an effect; None where nothing does."""
    named = look.borne_out(told.cause, guess) if told.cause else None
    return named or look.borne_out(told, guess)


def _least_p(told: Told) -> float:
    """Return the least chance of all names that gain more than that."""
    return min(each.p for each in (told, *told.others))


def chosen(
    said: Told | None, named: Step | None, plain: Step | None, guess: Step | None, of: Of
) -> Step | None:
    """Return what is added to a model, of all that might be; None where nothing is.

    A listed effect without features has to gain more than the features that were told, and than the
    form in which they go into the model. One beyond the list has to gain more than any listed one,
    by more than the error of the difference, and to be no other form of what features name.

    Parameters
    ----------
    said
        What features say.
    named
        That as an effect in the model; None where nothing bears it out.
    plain
        What is listed, and has no features.
    guess
        What is beyond the list.
    of
        The recording, and the sample in which each step of the features begins.
    """
    listed = named
    if plain is not None:
        by_features = 0.0 if said is None else said.gain.nats
        most = max(by_features, 0.0 if named is None else named.choice.best.nats)
        listed = plain if plain.choice.best.nats > most else named
    if guess is None:
        return listed
    is_ahead = listed is None or guess.choice.best.over(listed.choice.best) > SURE
    if said is not None:
        is_ahead = is_ahead and _leads(guess, said, of)
    return guess if is_ahead else listed
