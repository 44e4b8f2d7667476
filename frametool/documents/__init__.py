"""YAML, JSON and XML: text to plain values and back, and the place of each value in the text."""
