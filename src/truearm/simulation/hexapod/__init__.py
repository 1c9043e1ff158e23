"""Campaigns with the hexapod device on a digital twin."""
