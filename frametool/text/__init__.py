"""Bytes <-> lines, cells and floats in bulk: knows no geometry and no format's meaning."""
