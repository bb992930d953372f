"""The Maritime Robotics Otter: an uncrewed surface vehicle with two propellers."""
