"""The controller as algebra of references and measured positions, and what logs show of it."""
