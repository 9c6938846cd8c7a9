"""Sets of causes: added, dropped, exchanged, merged until nothing more is worth a cause."""
