"""Where the gap lies, how far it shrinks on validation logs, and what they would have shown."""
