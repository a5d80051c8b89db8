"""The search for the fault that explains an image: what is drawn, measured, tried and said."""
