"""What a run leaves: result.json, the patched deck, predictions."""
