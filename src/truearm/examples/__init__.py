"""Files to start from: the robot file to fill in."""
