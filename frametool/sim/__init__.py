"""The turtles: turtlesim's world, its leaders and followers, in simulated time.

Knows no display and no options. Text is read by `scene` and written by `simulate` only.
"""
