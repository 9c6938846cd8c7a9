"""What the side-by-side runs share: an independent model of the robot, drives, tables."""
