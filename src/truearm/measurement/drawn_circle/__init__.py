"""A circle that the robot draws on paper with a sprung pencil, and the scan of the page (Patel, section 5.5.2)."""
