"""`zfcal calibrate`: rounds, the likelihood that seeds them, held-out minutes."""
