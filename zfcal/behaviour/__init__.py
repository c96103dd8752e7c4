"""What a group does in a window of time, and how alike two windows are.

Pure functions on samples and counts. No file is opened here, and nothing here
knows how the model moves its agents.
"""
