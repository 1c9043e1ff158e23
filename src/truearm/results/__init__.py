"""Frozen records of what was found: reports and commands read them and copy nothing."""
