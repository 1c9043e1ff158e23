"""Measuring programs of tests by ISO 9283: what the robot does in each of them, checked before it is written."""
