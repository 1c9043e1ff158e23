"""Instruments: what each sees of a robot, how well, and which readings are its own."""
