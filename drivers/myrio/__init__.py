"""NI myRIO-1900 through nifpga: settings, counts, the FPGA session, and the device made of them."""
