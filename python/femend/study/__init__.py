"""The study file and running it."""
