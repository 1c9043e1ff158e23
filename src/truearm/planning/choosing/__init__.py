"""Which configurations to measure: observability, exchange search, predicted accuracy."""
