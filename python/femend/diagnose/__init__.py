"""Detect, locate, name, validate."""
