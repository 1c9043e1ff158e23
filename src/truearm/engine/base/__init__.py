"""Refusals, units, limits; files as they are read, written and replaced; parts of great work."""
