"""What a sample is worth: an option of the group ``reward`` is a file here. None sees the truth."""
