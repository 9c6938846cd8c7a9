"""Properties of measured signals: motion, noise, filters, encoder steps, standstill."""
