"""What is read off the frames of a run, and how it leaves for other programs."""
