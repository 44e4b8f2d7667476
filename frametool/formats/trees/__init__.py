"""Formats with a few poses of named frames, one file per format: read into edges of a tree, some also written."""
