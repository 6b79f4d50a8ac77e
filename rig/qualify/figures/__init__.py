"""The figures of benchmarks: several rounds as one, beside earlier ones, as a page."""
