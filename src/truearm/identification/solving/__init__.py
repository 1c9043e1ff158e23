"""What is minimised, and how: problem, losses, bounds, solver, fit, redundancy."""
