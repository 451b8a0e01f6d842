"""One element measured by itself, with no structure around it."""
