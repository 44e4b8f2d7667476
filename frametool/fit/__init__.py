"""The arithmetic of fitting: pairs, alignments, clocks, mountings, errors of trajectories.

Pure functions over arrays, free of files, text and options, that read like the papers they name.
"""
