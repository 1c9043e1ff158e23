"""Calibration axis by axis, from circles."""
