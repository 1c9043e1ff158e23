"""Recordings of a ROS cell: topics of joints and targets, the standstills in them, and what was seen there."""
