"""Measuring with the hexapod device: what the robot can reach, in which order, and in two steps."""
