"""Files to data and back."""
