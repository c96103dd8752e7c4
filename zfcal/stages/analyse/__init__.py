"""`zfcal analyse`: statistics of windows, controls and scores."""
