"""A campaign planned: criteria, poses and paths in the cube, ways, programs, files."""
