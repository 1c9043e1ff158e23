"""Identification: start values, the whitened problem, solver, losses, variance components, designs."""
