"""What recordings are off by: clocks, axes, cut-offs and cross-talk, found and put right."""
