"""What to measure, and how it is driven: `truearm plan`, `truearm poses`."""
