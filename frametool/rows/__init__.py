"""Rows of any format through an operation to rows of any format, block by block: knows no command line.

sources: what rows come from
record, holders, columns, columns_earth, columns_uncertain: what their numbers are, by the names of keys and columns
shapes, request, plan: what they mean, what is done with them, and where the results go
evaluate, plain: the numbers of one block as arrays, and those of few records without numpy
sinks: what results are written as
faults: a run from end to end, with the bad rows
"""
