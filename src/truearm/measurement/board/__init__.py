"""A ChArUco board that a camera sees: pictures, the lens, and where the board is."""
