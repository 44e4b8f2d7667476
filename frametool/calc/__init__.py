"""Expressions over poses, points and numbers, whose frames are checked like units."""
