"""The three comparisons: torque in closed loop, torque by inverse dynamics, positions under targets."""
