"""The study file: its keys, how they are checked, and what was read."""
