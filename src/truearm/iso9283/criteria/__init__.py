"""Criteria of ISO 9283, from poses, samples and pushes."""
