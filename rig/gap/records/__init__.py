"""Which rows and records the diagnosis can use, and what pairs with what. No effect and no verdict is known here."""
