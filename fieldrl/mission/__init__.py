"""A vehicle in a field: environment, reward, learning, record. No input or output."""
