"""The statistics of a group: one file for each kind, with all that the rest asks of it.

A file names its statistics in ``STATISTICS``, by which ``registry`` finds it. What a
statistic is, and how its observations are counted, stands in ``statistic``.
"""
