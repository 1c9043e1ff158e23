"""Robot files: one YAML file is one robot, nominal or calibrated.

Lengths are written in the file's own units and kept in SI inside. Reading a file and writing it again gives the
same file from the second time on.
"""
