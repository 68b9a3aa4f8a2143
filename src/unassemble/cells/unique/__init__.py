"""Whether other cells fit as well: the same search with the answer excluded."""
