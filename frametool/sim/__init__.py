"""The turtles: turtlesim's world, its leaders and followers, in simulated time.

Text is read only by `scene` and written only by `simulate`; the package does not depend on a display or on options.
"""
