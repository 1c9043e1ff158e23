"""One ballbar between six cups: `truearm hexapod`."""
