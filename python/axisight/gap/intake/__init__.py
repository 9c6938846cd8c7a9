"""What a user hands over, turned into logs that can be compared."""
