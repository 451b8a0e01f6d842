"""A model in a small basis: modes of the band, static answers, parameters that move both."""
