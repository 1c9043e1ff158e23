"""Where to begin: `truearm example`, `demo`, `new-robot`, `study`."""
