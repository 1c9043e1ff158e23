"""Going through a plan with an instrument, reading by reading.

What is measured next, what a reading is worth by itself, and a log of all of them on disk. Nothing here knows a model
of the robot, so no reading can be kept or set aside for how well it fits.
"""
