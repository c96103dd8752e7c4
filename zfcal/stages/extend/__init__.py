"""`zfcal extend`: an effect is added, and the gap on held-out minutes measured."""
