"""Which action: rankings, profiles, guards, monitors, environments."""
