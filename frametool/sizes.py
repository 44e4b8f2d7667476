"""How much a run reads, holds or computes at once: a matter of speed and memory, which no result depends on.

Code reads them here as `sizes.BLOCK` when a run begins, so that a test can set them.
"""

BLOCK = 1 << 19  # bytes of a stream of lines
RECORD = 1 << 26  # bytes of the longest row or record in such a stream: a longer one is refused
SMALL = 1 << 14  # bytes of records that may be few
FEW = 64  # records of a whole stream: up to so many are computed one by one, without numpy
LEARNED = 64  # records from which those written alike are learned, to compute them together; 0: each one alone
TABLE = 1 << 24  # bytes of a table of results that waits in memory until its columns are known; a longer one in a file
TYPED = 1 << 18  # rows whose cells say what the types of columns are
GROUP = 3 << 26  # bytes of a group of rows in a file of columns that is held as a whole, four times in all: below 1 GB
PIECE = 1 << 20  # bytes of a file of documents that are read at once
STRETCH = 1 << 17  # characters of a recording that are parsed at once
ASIDE = 1 << 16  # characters of YAML: in shorter texts plain lists are not worth a reader of their own
PAGE = 512  # samples of an edge over time: a longer page is cut when a late one falls into it
FOLLOWERS = 1 << 14  # of a sweep, at a time; smaller blocks spend their time on calls
