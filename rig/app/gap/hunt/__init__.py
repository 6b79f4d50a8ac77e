"""What `pamrig gap hunt` does: record, diagnose, record what parts what is still possible. Everything known lies in the
hunt's folder, so that one that was interrupted goes on."""
