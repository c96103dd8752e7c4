"""A scene under a model: what the statistics of a diagnosis ask of both, worked out once."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from zfcal.arrays import Floats
from zfcal.diagnose.surroundings import Surroundings, probabilities, surroundings
from zfcal.model.fitted import Fitted
from zfcal.model.packing import pack
from zfcal.model.scene import Scene
from zfcal.model.views import speed_factor


@dataclass(frozen=True, kw_only=True, eq=False)
class Standing:
    """A scene under a model.

    Parameters
    ----------
    scene
        Where everybody was.
    fitted
        The model that is doubted, at its maximum likelihood on the scene.
    probability : ndarray, shape (turn, cell)
        Of each cell of headings under the model, lapses included.
    turns, moves
        What the agents of the scene's turns and moves had about them.
    """

    scene: Scene
    fitted: Fitted
    probability: Floats
    turns: Surroundings
    moves: Surroundings

    @cached_property
    def speed_factor(self) -> Floats:
        """By what the model's effects multiply the speed of each move, shape (move,)."""
        return speed_factor(self.scene, pack([self.fitted.parameters], self.scene.arena))


def standing_of(scene: Scene, fitted: Fitted, table: Floats | None = None) -> Standing:
    """Return a scene under a model.

    Parameters
    ----------
    table : ndarray, shape (turn, cell)
        The second table of ``fitted.tables()``, where it is at hand.
    """
    return Standing(
        scene=scene,
        fitted=fitted,
        probability=probabilities(fitted, table),
        turns=surroundings(scene, scene.turns),
        moves=surroundings(scene, scene.moves),
    )
