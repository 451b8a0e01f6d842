"""Nodes elsewhere: morphs, and a model moved along them."""
