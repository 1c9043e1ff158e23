"""Axis-by-axis calibration from circles: `truearm axes`."""
