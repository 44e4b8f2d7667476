"""The turtles: turtlesim's world, its leaders and followers, in simulated time.

Knows no display and no options. Text is read and written by `scene` and `step_writer` only.
"""
