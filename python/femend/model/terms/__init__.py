"""Terms that a deck may lack, in one or several configurations: supports, bushes, rotors."""
