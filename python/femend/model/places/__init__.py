"""Where something may be missing: every joint, support, member, region, connection and facing pair."""
