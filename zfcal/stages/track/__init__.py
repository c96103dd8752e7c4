"""`zfcal track`: from a recording's images to closed segments of tracks."""
