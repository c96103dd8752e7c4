"""`zfcal camera`, and which cameras and images a trial has."""
