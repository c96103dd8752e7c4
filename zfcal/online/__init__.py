"""`zfcal watch`: what has arrived, which stage runs next, and the processes that work."""
