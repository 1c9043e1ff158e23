"""What was read: the dataset, which checks itself, what readings are predicted to be, and error statistics."""
