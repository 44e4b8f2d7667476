"""Format -> operation -> format over blocks of rows, and the one policy for bad rows: knows no command line."""
