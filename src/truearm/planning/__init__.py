"""Where to measure: poses, paths, and configurations that tell parameters apart."""
