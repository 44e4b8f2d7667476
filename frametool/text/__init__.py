"""Bulk conversion of bytes to lines, cells and floats, and back: knows no geometry and no format."""
