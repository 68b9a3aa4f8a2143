"""Labels between 0 and 1 along a barrier path, where very many may be wrong."""
