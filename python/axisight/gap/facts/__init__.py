"""What a diagnosis says and what it is asked: data alone."""
