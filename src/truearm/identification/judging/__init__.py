"""What to think of data and fits: plausibility, what residuals show, advice, Monte Carlo."""
