"""`femend update`: the parameters of a study updated on its test."""
