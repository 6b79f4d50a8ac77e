"""What the page's viewers see as it happens: status and plots, from the daemon to every browser."""
