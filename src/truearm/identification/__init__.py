"""From readings to the parameters of the real robot."""
