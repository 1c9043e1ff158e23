"""Calibration with the hexapod device: in two steps, and from several places."""
