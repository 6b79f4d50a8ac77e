"""Tests on the raw samples: what least squares on smoothed columns is blind to. No fit and no verdict is known here."""
