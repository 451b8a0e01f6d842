"""What a test says and what its deck says of it: modes, operating shapes, sensors at their places."""
