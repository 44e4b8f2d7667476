"""The turtles: turtlesim's world, its leaders and followers, in simulated time; knows no text, no files, no screen."""
