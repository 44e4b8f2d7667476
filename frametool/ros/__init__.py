"""ROS messages, echo text, bags, publisher arguments, Foxglove."""
