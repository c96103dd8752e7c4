"""Schemas of every artifact, as data files; installed as ``zfcal.schemas``."""
