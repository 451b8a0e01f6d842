"""A deck with its parameters and terms; a change gives a new model."""
