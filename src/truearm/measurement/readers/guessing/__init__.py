"""What the columns of somebody's table seem to mean: a mapping file for a person to confirm."""
