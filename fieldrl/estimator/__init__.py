"""What the robot concludes: the fit problem and the methods that solve it."""
