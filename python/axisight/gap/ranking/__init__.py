"""Ranks fitted hypotheses: probabilities, intervals, and what cannot be told apart."""
