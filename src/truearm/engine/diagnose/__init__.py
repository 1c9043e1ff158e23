"""What to know about data and fits: expected error, slips, sigma, what moved, gears, advice."""
