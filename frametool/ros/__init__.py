"""ROS messages, echo text, bags, publisher arguments, Foxglove; tf2's listing."""
