"""The stages of the pipeline on a trial directory: a module or a folder for each command.

Each stage reads closed files and makes what is missing or stale. It tells what
happens through a callback; nothing here prints.
"""
