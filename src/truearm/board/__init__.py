"""A ChArUco board in pictures, or its poses in a camera: `truearm import hand-eye`."""
