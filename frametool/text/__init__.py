"""Bulk conversion of bytes to lines, cells and floats, and back, without geometry and formats."""
