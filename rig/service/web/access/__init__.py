"""Who may look at the page and who may command by it, down to the single connection."""
