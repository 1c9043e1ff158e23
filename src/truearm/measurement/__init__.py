"""What was measured, what is compared, and what simulates it."""
