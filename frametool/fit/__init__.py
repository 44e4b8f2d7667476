"""Estimation: pairing, alignment, clock offsets, mounting, errors of trajectories, and calibration.

Pure functions over arrays, free of files, text and options, in the notation of the papers they cite.
"""
