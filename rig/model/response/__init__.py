"""How one rig answers, close enough to stand for a day of its records: the response model, and the records that a
fingerprint keeps."""
