SCALAR = {}
