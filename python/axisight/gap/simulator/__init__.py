"""The user's simulator: its own parameters, their tolerances, and the torque that it predicts."""
