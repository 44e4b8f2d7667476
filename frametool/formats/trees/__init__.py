"""Forms that hold a few poses of named frames, one file a form: read into edges of a tree, some of them written too."""
