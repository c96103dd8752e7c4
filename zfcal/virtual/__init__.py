"""A rig that is not there: tank, fish, cameras, robot and experiment, and their film."""
