"""What is missing: laws at the best places, judged on data that no fit has seen."""
