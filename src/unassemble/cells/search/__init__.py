"""Best-first search for labels, small changes being ranked by low-rank updates of one factorisation."""
