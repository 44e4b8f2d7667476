"""Text to plain values and back, and from a path to its place: YAML and JSON."""
