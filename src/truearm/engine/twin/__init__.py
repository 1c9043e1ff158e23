"""What could have been read: a digital twin on a path of its own, its truths and its instruments."""
