"""What a given GPU program computes, pass by pass, with its number formats and its mistakes."""
