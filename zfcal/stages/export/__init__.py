"""`zfcal export`: a trial in the forms of other programs."""
