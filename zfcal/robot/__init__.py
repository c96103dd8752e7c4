"""The robot: its language, its line, its motion, and one to try things with.

What it is to do comes from elsewhere (`zfcal.drive`); nothing here knows of models or files.
"""
