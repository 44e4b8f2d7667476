"""What a person looks at: aligned text, drawings; the only place that imports rich."""
