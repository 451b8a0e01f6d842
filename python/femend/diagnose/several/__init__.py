"""More than one effect: pairs of places, laws side by side and fitted together."""
