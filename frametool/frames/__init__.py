"""Frame trees, stamps and lookups, without formats and files."""
