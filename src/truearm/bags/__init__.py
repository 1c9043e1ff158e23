"""Recordings of ROS cells: `truearm import ros`."""
