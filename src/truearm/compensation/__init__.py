"""Programs and paths corrected for the calibrated robot: `truearm compensate`, `truearm path`."""
