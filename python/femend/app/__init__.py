"""What the command line and other front ends share: progress."""
