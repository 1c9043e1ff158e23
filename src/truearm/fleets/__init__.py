"""Many robots of a series: what is asked of them, and what was found of each."""
