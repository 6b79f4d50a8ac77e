"""The diagnosis in sentences, for the terminal and the page. `sentences` asks the questions in their order; a module an
answer. No number is computed here."""
