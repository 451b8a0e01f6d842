"""Studies that go through stages: several configurations, operating recordings."""
