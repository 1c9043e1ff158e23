"""Tests of a robot's performance by the criteria of ISO 9283:1998: what is measured, where and how often."""
