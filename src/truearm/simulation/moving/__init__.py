"""The digital twin in motion: a controller that interpolates, joints that follow, an arm that warms up."""
