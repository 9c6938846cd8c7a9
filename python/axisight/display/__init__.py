"""Display results in terminals and notebooks, and show progress."""
