"""What is worked out and explained: expressions whose frames are checked, and derivations with a run's numbers."""
