"""Which poses to measure and which way to go: the cube of ISO 9283, its poses, paths, time laws, joint motions."""
