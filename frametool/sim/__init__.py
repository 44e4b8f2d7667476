"""The turtles: turtlesim's world, its leaders and followers, in simulated time.

Knows no screen and no options. Text is the work of `readers`, `scene_file` and `step_writer`; the rest knows none.
"""
