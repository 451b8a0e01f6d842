"""A law at a place: how it starts, how it is fitted with the whole model, what it then predicts."""
