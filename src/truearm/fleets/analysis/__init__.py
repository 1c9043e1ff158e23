"""What a fleet says: accuracy over the series, robots that differ, spread of the parameters, and their drift."""
