"""stub"""
from dataclasses import dataclass
@dataclass(frozen=True)
class Cells:
    recognised: bool = False
    backward_error: float = float('nan')
    n_cells: int = 0
def no_cells(d): return Cells()
def recognise_cells(nodal, points): return Cells()
