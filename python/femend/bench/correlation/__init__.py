"""`femend correlate`: a deck as it stands against its test."""
