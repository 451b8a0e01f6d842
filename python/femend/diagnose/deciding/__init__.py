"""The verdict: what was found, how sure, what to say where the data cannot tell."""
