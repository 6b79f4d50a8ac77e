"""One Gaussian likelihood of a residual: its cosine lines (`lines`), a variance each and patterns of unsure size
(`gaussian`), and a law that is wrong by a share of itself (`rough_law`). It knows no effect and no rig."""
