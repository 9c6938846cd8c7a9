"""The user's simulator: its own parameters and their tolerances, and the torque that it predicts."""
