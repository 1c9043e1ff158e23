"""A plan measured reading by reading: `truearm measure`."""
