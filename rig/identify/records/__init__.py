"""Records before anything is fitted to them: checked, on the model's clock, with what somebody mixed up named."""
