"""Tilt, backlash and stiffness from inclinometers on the links."""
