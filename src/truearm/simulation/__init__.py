"""Simulated measurements, and the influence of parameters: `truearm simulate`, `truearm influence`."""
