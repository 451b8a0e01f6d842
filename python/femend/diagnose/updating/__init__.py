"""The model by itself: its parameters updated, and whether what is left is noise, drift or a level's doing."""
