"""What may be the cause: the library of effects with their laws (`library`), what each changes in a factor's columns
(`changes`), and its likeliest numbers (`fit`). `inverse_problems` brings law, response and likelihood together for
pressures and angle."""
