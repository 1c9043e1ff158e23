"""Refusals, units, limits; files as they are read, written and replaced; work done in parts."""
