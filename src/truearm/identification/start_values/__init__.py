"""Where a fit starts: base, targets and fixtures from readings."""
