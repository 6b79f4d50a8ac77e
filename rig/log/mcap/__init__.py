"""Our MCAP files: their frame and chunks (`framing`, `frame_writer`), samples as columns (`columns`), the names of it
all (`schema`), and what a damaged file still proves (`salvage`)."""
