"""The controller's law as algebra, and the differences from it that logs show."""
