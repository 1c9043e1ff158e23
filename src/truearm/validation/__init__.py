"""Proofs of accuracy beyond the errors of single readings."""
