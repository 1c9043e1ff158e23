"""What to command, so that the real robot does what was meant."""
