"""Two sets of trials against each other: how they differ, and what so few can show."""
