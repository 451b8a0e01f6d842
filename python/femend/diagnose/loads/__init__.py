"""What acts on the structure and was not recorded as it is: forces, humming, ground motion, misplaced loads."""
