"""What the command line and other front ends share: progress, and output that is written whole or not at all."""
