"""What looks mistaken when a test is held against its deck: sensors, units, frames, frequencies."""
