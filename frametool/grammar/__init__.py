"""Parse plain values into poses, points and trees, and convert results back into plain values."""
