"""What to know about data and fits: expected error, data-entry errors, sigma, what moved, gears, advice."""
