"""Paths, time laws and the joint motions along them."""
