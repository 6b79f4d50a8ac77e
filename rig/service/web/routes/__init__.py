"""The page's addresses, and what is answered at each."""
