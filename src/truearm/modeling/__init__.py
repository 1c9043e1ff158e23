"""The robot model: chain, conventions, parameters, effects, formats."""
