"""Where something is missing: places, what a free force at each would leave, and which of them look alike."""
