"""A folder for each area; each figure in the documentation comes out of one command there."""
