"""Performance tests by ISO 9283: `truearm iso9283`."""
