"""The stages of the pipeline on a trial directory, and how they are strung together.

Each stage reads closed files and makes what is missing or stale. It tells what
happens through a callback; nothing here prints.
"""
