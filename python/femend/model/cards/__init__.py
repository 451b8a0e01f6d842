"""What stands on the cards of a deck: reals, masses, units, ids, values that are seldom meant."""
