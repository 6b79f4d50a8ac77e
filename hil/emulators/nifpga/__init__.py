"""A myRIO without a myRIO: a C library that the unmodified nifpga package loads, and the rig behind its registers."""
