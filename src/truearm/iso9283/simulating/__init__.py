"""A campaign on the twin that moves."""
