"""Read and write recordings: ROS 1 bags, ROS 2 bags and MCAP files, through rosbags and mcap."""
