"""Which candidates are cells: labels between 0 and 1, and wrong ones put right."""
