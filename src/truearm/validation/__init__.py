"""A robot judged on other data: `truearm validate`, `distances`, `sphere`, `lines`, `tolerance`."""
