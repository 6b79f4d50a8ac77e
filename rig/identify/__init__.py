"""The parameters of a model from records: `records` checks and prepares them, `search` has the optimisers, `response`
fits the regulators and the response model, `fit` does it all in order, `validate` judges it."""
