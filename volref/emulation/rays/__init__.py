"""Where rays enter and leave the box, and how they are divided into steps."""
