"""Files to start from: a robot file to fill in, a program to correct, the commands of a session."""
