"""Probes: from what a machine draws of tiny scenes, how it filters, snaps, blends and rounds."""
