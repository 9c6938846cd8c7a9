"""Groups of options in ``--help``; common options stand in none, and come first."""

OUTPUT = "More output"
COMPARED = "What is compared"
SIMULATOR = "Simulator"
EXPERIMENT = "Next experiment"
FLEET = "Many robots or days"
ADVANCED = "Advanced"
