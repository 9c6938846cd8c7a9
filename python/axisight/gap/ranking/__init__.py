"""Fitted hypotheses held against one another: probabilities, intervals, what cannot be told apart."""
