"""The commands as Python functions, and what the command line does with its options.

Each module has a function of the package `zfcal` and, above it, what its command calls as well:
the two cannot drift apart. What is heavy is loaded when it is called for.
"""
