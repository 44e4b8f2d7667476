"""Streams of rows: read any format, apply an operation block by block, write any format.  Independent of the CLI.

sources: readers of tables, records and files of columns
record, holders, columns, columns_earth, columns_uncertain: the meaning of numbers, from the names of keys and columns
shapes, request, plan: the meaning of a row, the operation on it, and where its result is written
evaluate, plain: the arithmetic, on arrays for blocks, and without numpy for few records
sinks: writers
faults: the run from the first block to the exit status, with reports of bad rows
"""
