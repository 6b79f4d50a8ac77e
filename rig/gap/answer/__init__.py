"""From posteriors to the diagnosis: verdict, causes, where the gap lies and how far it shrinks (`how_far`), and all of
it in sentences (`words`). `assemble` puts it together, `result` and `facts` are what comes of it. Nothing is weighed
here."""
