"""What to command so that the real robot goes where the program says."""
