"""Plain values to poses, points and trees, and results back to plain values."""
