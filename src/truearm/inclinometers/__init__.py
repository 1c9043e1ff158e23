"""Tilting, backlash and compliance from inclinometers: `truearm tilting`."""
