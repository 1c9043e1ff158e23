"""Poses to measure: ISO 9283, cubes, lines in seven directions."""
