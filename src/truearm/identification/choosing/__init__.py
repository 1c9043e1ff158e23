"""Which model: the joint effects that the data can carry, a model for each zone."""
