"""An updated deck: which fields change, and the deck read again."""
