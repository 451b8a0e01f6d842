"""The catalogue of laws: names, families, parameters, units."""
