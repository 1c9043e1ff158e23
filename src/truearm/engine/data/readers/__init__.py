"""What brings measured data in: the canonical CSV, plain matrices, and any table with a mapping."""
