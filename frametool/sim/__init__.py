"""The turtles: turtlesim's world, its leaders and followers, in simulated time.

Knows no screen and no options. What is read and written as text is in `scenes`, `twists` and
`records`; the rest knows none.
"""
