"""Frame trees, stamps and lookups: knows geometry, no text and no files."""
