"""Cameras: lens, pose and plane, how they are calibrated, and the images they give."""
