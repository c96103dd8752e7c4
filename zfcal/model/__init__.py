"""The behavioural model: simulation, one-step density, effects."""

from zfcal.model.kernels import compiled as _compiled  # noqa: F401  # before any kernel is declared
