"""Where an arm may stand and how it gets there: cells, collisions, ways, cubes, paths and joint motions."""
