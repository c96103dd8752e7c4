"""`zfcal diagnose`: what is asked of a window of tracks, and what is kept."""
