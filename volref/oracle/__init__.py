"""Judging images: how far apart two of them are."""
