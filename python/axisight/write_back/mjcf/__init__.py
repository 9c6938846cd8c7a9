"""Parts of an MJCF that causes change: actuators, motors without commands, sensors, play, and their versions."""
