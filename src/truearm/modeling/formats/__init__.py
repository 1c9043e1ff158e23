"""Files that hold robots: truearm's own YAML, URDF, DH tables, JSON, Python."""
