"""The page of a diagnosis, and who draws it."""
