"""Measurements of how a robot performs: poses attained, paths run, the way it comes to rest, and pushes."""
