"""The robot identified, judged and written: `truearm calibrate`."""
