"""What is doubtful about a study before and after it is run, and what its mending would do."""
