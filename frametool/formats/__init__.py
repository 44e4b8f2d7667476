"""File formats: the table of all formats, the detection of a file's format, and the conversion of files to trees."""
