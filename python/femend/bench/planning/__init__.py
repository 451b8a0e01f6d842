"""`femend pretest`: a test planned on the model of a study."""
