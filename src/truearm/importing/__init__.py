"""Tables and files of other programs: `truearm import`."""
