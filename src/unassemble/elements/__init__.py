"""Elements: which kinds there are, their nodes and matrices, and which cells a sparsity graph with positions shows.

Nothing here knows what a matrix belongs to: scalar and vector-valued operators use the same kinds, shape functions,
element matrices and candidates.
"""
