"""What is expected of a rig without a gap, and how surely: by earlier days, a fingerprint or the simulator (`kinds`,
`build`), as the two factors of the likelihood (`expectation`). No effect is known here."""
