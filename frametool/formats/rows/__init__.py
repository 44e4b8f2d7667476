"""Formats with many rows, of poses or of columns of numbers, read and written in blocks of rows."""
