"""What the report shows: curves, tables, pictures, references."""
