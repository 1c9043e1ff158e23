"""Many robots, simulated or measured: `truearm fleet`."""
