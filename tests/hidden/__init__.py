"""A second simulator of the zoned vision model, for trials that hide an effect.

It is written from the text of the model alone and shares no code with what it
is to put to the test: own geometry, own solid angles, own densities, own fit.
Its effects have functional forms of their own.
"""

from .freshness import forget_stale_kernels

forget_stale_kernels()
