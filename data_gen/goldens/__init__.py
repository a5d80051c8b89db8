"""The golden suite of volref: small real scans, digests and pictures, and the bundles themselves."""
