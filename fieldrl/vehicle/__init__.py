"""What the robot can do: kinematics and sensors."""
