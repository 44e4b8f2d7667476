"""Recordings: ROS 1 bags, ROS 2 bags and MCAP files, read, written and copied, through rosbags and mcap."""
