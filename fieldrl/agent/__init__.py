"""How the robot chooses: agents that learn, and agents to compare them with."""
