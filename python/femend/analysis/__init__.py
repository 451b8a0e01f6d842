"""Modes, FRFs and responses of a model as data objects."""
