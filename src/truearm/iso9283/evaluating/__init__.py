"""A campaign evaluated: files read, doubts, criteria, comparison, report."""
