"""Generator of concealed-effect cases: virtual tests whose truth shares no code with the package under test."""
