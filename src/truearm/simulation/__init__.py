"""The digital twin, truths for it, and instruments that measure it."""
