"""The driver: from poses to commands of the robot, with its clock, log and replay."""
