"""The core math: knows numbers only, no names, no text, no files."""
