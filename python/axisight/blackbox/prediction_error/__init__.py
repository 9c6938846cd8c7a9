"""Models with a noise model, by the prediction-error method."""
