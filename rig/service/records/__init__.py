"""What a session leaves behind: the recorder that writes samples into files, black boxes, the ledger of files, and what
to do when the disk is full."""
