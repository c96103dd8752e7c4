"""Files of a trial: formats, provenance, staleness and locks; nothing of behaviour or models."""
