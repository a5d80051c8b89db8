"""The volume and the table as textures, and what a position finds in them."""
