"""Intervals around an emulation: how far a correct machine may be from it, carried through a ray."""
