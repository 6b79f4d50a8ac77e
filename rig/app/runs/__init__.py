"""What the commands that move a rig do: a sweep, a reference or a recording becomes programs (`sweeping`, `tracking`,
`replaying`), `runner` opens the session, `under_way` watches it, `outcome` judges."""
