"""The daemon's socket: who may connect, what a line may say, and what is answered."""
