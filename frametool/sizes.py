"""Sizes of blocks and limits: they affect speed and memory, never results.

They are read as `sizes.BLOCK` when a run begins, so that a test can set them.
"""

BLOCK = 1 << 19  # bytes of a stream of lines
RECORD = 1 << 26  # bytes of the longest row or record in such a stream: longer ones are refused
SMALL = 1 << 14  # bytes of records that may be few
FEW = 64  # records of a whole stream: up to this many are computed one by one, without numpy
LEARNED = 64  # records from which a common layout is learned, to compute them together; 0: always one by one
TABLE = 1 << 24  # bytes of a table of results kept in memory until its columns are known; a longer one in a file
TYPED = 1 << 18  # rows whose cells determine the types of columns
GROUP = 3 << 26  # bytes of a group of rows of a column file that is read as a whole, four times in all: below 1 GB
STRETCH = 1 << 17  # characters of a recording that are parsed at once
ASIDE = 1 << 16  # characters of YAML: plain lists in shorter texts are not worth a separate reader

# of one text of documents
DEEPEST = 990  # levels of lists and maps; a chain of 60 frames has 120, and libyaml reads at most 1000
# characters or bytes of one file of documents; a million frames have 100 to 600 million
MOST_CHARACTERS = 1 << 30
# lists and maps in one text: each needs 64 bytes or more, and 3 characters; a million messages have 6e6
MOST_CONTAINERS = 10_000_000
# commas and line ends in one text: each value needs 60 bytes; a million messages on lines have 4e7
MOST_VALUES = 50_000_000
