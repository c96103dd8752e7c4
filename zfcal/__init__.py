"""Track, analyse, calibrate and drive: a robot among zebrafish."""

from importlib.metadata import version

__version__ = version("zfcal")
