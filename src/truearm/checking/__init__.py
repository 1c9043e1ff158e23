"""What is wrong with measurements: `truearm check`."""
