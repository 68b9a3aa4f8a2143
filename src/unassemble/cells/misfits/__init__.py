"""What no choice of cells explains: which entries it is, and how far it reaches."""
