"""Circles on scanned pages: `truearm import circle`."""
