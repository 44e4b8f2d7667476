"""The forms of files: the table of what is read and written, how a file's form is told, and how files become trees."""
